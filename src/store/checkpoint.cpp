#include "store/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>
#include <utility>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMagicSize = 8;
constexpr std::size_t kHeaderSize = kMagicSize + 24;

constexpr std::string_view kSurveyMagic = "KNAPSURV";
constexpr std::string_view kPlanMagic = "KNAPPLAN";
constexpr std::string_view kScatterMagic = "KNAPSCAT";

using Bytes = std::vector<std::byte>;

[[noreturn]] void throw_damaged(const std::filesystem::path& path, std::string_view what) {
    throw StorageError(fmt::format("{}: scratch file is damaged: {}", path.string(), what));
}

void save(const std::filesystem::path& path, std::string_view magic, const Bytes& payload) {
    Bytes header;
    put(header, kVersion);
    put(header, std::uint32_t{0});
    put(header, static_cast<std::uint64_t>(payload.size()));
    put(header, xxh3_64(payload));
    AtomicFile file(path, AtomicFile::Durability::kProcess);
    file.write(magic);
    file.write(header);
    file.write(payload);
    file.commit();
}

Bytes load(const std::filesystem::path& path, std::string_view magic) {
    try {
        const InputFile file(path);
        Bytes header(kHeaderSize);
        if (file.read_some(0, header) != header.size()) {
            throw_damaged(path, "the header is cut short");
        }
        ByteReader fields{std::span(header).subspan(kMagicSize)};
        const auto version = fields.get<std::uint32_t>();
        fields.get<std::uint32_t>();
        const auto size = fields.get<std::uint64_t>();
        const auto checksum = fields.get<std::uint64_t>();
        if (std::memcmp(header.data(), magic.data(), kMagicSize) != 0 || version != kVersion ||
            size != file.size() - kHeaderSize) {
            throw_damaged(path, fmt::format("expected the header of a {}", magic));
        }
        Bytes payload(size);
        if (file.read_some(kHeaderSize, payload) != payload.size() ||
            xxh3_64(payload) != checksum) {
            throw_damaged(path, "it does not match its checksum");
        }
        return payload;
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

void put_box(Bytes& out, const Box& box) {
    for (const Vec3& corner : {box.min, box.max}) {
        put(out, corner.x);
        put(out, corner.y);
        put(out, corner.z);
    }
}

Box get_box(ByteReader& in) {
    Box box;
    for (Vec3* corner : {&box.min, &box.max}) {
        corner->x = in.get<double>();
        corner->y = in.get<double>();
        corner->z = in.get<double>();
    }
    return box;
}

void put_voxel(Bytes& out, const VoxelCoord& voxel) {
    put(out, voxel.x);
    put(out, voxel.y);
    put(out, voxel.z);
}

VoxelCoord get_voxel(ByteReader& in) {
    const auto x = in.get<std::int32_t>();
    const auto y = in.get<std::int32_t>();
    const auto z = in.get<std::int32_t>();
    return {x, y, z};
}

// Voxels come in the order of a tree, so that steps are small, to either side.
void put_step(Bytes& out, std::int32_t from, std::int32_t to) {
    const std::int64_t step = std::int64_t{to} - from;
    put_varint(out, static_cast<std::uint64_t>(step < 0 ? -2 * step - 1 : 2 * step));
}

std::int32_t get_step(ByteReader& in, std::int32_t from) {
    const auto folded = static_cast<std::int64_t>(in.get_varint() & 0x3ffffffffU);
    return static_cast<std::int32_t>(from + (folded % 2 != 0 ? -(folded + 1) / 2 : folded / 2));
}

void put_voxels(Bytes& out, std::span<const Voxel> voxels) {
    put(out, static_cast<std::uint64_t>(voxels.size()));
    VoxelCoord before;
    for (const Voxel& voxel : voxels) {
        for (int axis = 0; axis < 3; ++axis) {
            put_step(out, before[axis], voxel.at[axis]);
        }
        put_varint(out, voxel.points);
        before = voxel.at;
    }
}

std::vector<Voxel> get_voxels(ByteReader& in) {
    std::vector<Voxel> voxels(std::min<std::uint64_t>(in.get<std::uint64_t>(), in.left()));
    VoxelCoord before;
    for (Voxel& voxel : voxels) {
        for (int axis = 0; axis < 3; ++axis) {
            voxel.at[axis] = get_step(in, before[axis]);
        }
        voxel.points = static_cast<std::uint32_t>(in.get_varint());
        before = voxel.at;
    }
    return voxels;
}

void put_text(Bytes& out, std::string_view text) {
    put(out, static_cast<std::uint64_t>(text.size()));
    const auto bytes = std::as_bytes(std::span(text));
    out.insert(out.end(), bytes.begin(), bytes.end());
}

std::string get_text(ByteReader& in) {
    const auto size = in.get<std::uint64_t>();
    const std::byte* bytes = in.take(size);
    if (bytes == nullptr || size == 0) {
        return {};
    }
    std::string text(size, '\0');
    std::memcpy(text.data(), bytes, size);
    return text;
}

void check_read(const ByteReader& in, const std::filesystem::path& path) {
    if (!in.ok() || in.left() != 0) {
        throw_damaged(path, "it does not hold what it says");
    }
}

}  // namespace

void save_survey(const std::filesystem::path& path, const SourceTable& table,
                 const Occupancy& occupancy) {
    Bytes out;
    put(out, static_cast<std::uint64_t>(table.sources().size()));
    for (const SourceEntry& source : table.sources()) {
        put_text(out, source.given_path);
        put(out, source.points);
        put(out, source.rejected);
        put_text(out, source.xxh3);
    }
    put_box(out, table.box());
    put(out, occupancy.voxel_size());
    put_voxels(out, occupancy.voxels());
    save(path, kSurveyMagic, out);
}

SavedSurvey load_survey(const std::filesystem::path& path, std::span<const SourceInfo> infos) {
    const Bytes payload = load(path, kSurveyMagic);
    ByteReader in(payload);
    if (in.get<std::uint64_t>() != infos.size()) {
        throw_damaged(path, "it is of another number of sources");
    }
    std::vector<SourceEntry> entries;
    for (const SourceInfo& info : infos) {
        SourceEntry entry;
        entry.info = info;
        entry.given_path = get_text(in);
        entry.points = in.get<std::uint64_t>();
        entry.rejected = in.get<std::uint64_t>();
        entry.xxh3 = get_text(in);
        entries.push_back(std::move(entry));
    }
    const Box box = get_box(in);
    const auto voxel_size = in.get<double>();
    const std::vector<Voxel> voxels = get_voxels(in);
    check_read(in, path);
    return {SourceTable(std::move(entries), box), Occupancy(voxel_size, voxels)};
}

void save_plan(const std::filesystem::path& path, const BrickPlan& plan) {
    Bytes out;
    put(out, plan.voxel_size);
    put(out, static_cast<std::uint64_t>(plan.bricks.size()));
    for (const Brick& brick : plan.bricks) {
        put_voxel(out, brick.core.min);
        put_voxel(out, brick.core.max);
        put_box(out, brick.halo);
        put(out, brick.core_points);
        put(out, brick.halo_points);
    }
    save(path, kPlanMagic, out);
}

BrickPlan load_plan(const std::filesystem::path& path) {
    const Bytes payload = load(path, kPlanMagic);
    ByteReader in(payload);
    BrickPlan plan;
    plan.voxel_size = in.get<double>();
    plan.bricks.resize(std::min<std::uint64_t>(in.get<std::uint64_t>(), in.left()));
    for (Brick& brick : plan.bricks) {
        brick.core.min = get_voxel(in);
        brick.core.max = get_voxel(in);
        brick.halo = get_box(in);
        brick.core_points = in.get<std::uint64_t>();
        brick.halo_points = in.get<std::uint64_t>();
    }
    check_read(in, path);
    return plan;
}

void save_scatter_state(const std::filesystem::path& path, const ScatterState& state) {
    Bytes out;
    put(out, state.parts_done);
    put(out, static_cast<std::uint64_t>(state.bricks.size()));
    for (const ScatterState::Tally& brick : state.bricks) {
        put(out, brick.bytes);
        put(out, brick.core_points);
        put(out, brick.halo_points);
        put_box(out, brick.core_box);
    }
    save(path, kScatterMagic, out);
}

ScatterState load_scatter_state(const std::filesystem::path& path) {
    const Bytes payload = load(path, kScatterMagic);
    ByteReader in(payload);
    ScatterState state;
    state.parts_done = in.get<std::uint64_t>();
    state.bricks.resize(std::min<std::uint64_t>(in.get<std::uint64_t>(), in.left()));
    for (ScatterState::Tally& brick : state.bricks) {
        brick.bytes = in.get<std::uint64_t>();
        brick.core_points = in.get<std::uint64_t>();
        brick.halo_points = in.get<std::uint64_t>();
        brick.core_box = get_box(in);
    }
    check_read(in, path);
    return state;
}

}  // namespace knap
