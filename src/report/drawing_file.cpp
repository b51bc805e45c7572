#include <fmt/format.h>

#include <array>
#include <cstring>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "report/drawing.hpp"

namespace knap {

namespace {

constexpr std::array<char, 8> kMagic{'K', 'N', 'A', 'P', 'D', 'R', 'A', 'W'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeadBytes = kMagic.size() + sizeof kVersion;
constexpr std::size_t kPartHeadBytes = 2 * sizeof(std::uint64_t);

[[noreturn]] void throw_damaged(const std::filesystem::path& path, const char* expected) {
    throw StorageError(
        fmt::format("{}: scratch file is damaged: expected {}", path.string(), expected));
}

void put_vec(std::vector<std::byte>& out, const Vec3& v) {
    put(out, v.x);
    put(out, v.y);
    put(out, v.z);
}

Vec3 get_vec(ByteReader& in) {
    const auto x = in.get<double>();
    const auto y = in.get<double>();
    const auto z = in.get<double>();
    return {x, y, z};
}

void put_frame(std::vector<std::byte>& out, const Frame& frame) {
    put_varint(out, frame.view.name.size());
    for (const char c : frame.view.name) {
        put(out, c);
    }
    for (const Vec3& v : {frame.view.right, frame.view.up, frame.view.toward, frame.centre}) {
        put_vec(out, v);
    }
    for (const double number : {frame.left, frame.top, frame.near, frame.depth, frame.pixel}) {
        put(out, number);
    }
    put(out, static_cast<std::uint32_t>(frame.width));
    put(out, static_cast<std::uint32_t>(frame.height));
}

Frame get_frame(ByteReader& in) {
    Frame frame;
    frame.view.name.resize(std::min<std::uint64_t>(in.get_varint(), in.left()));
    for (char& c : frame.view.name) {
        c = in.get<char>();
    }
    for (Vec3* v : {&frame.view.right, &frame.view.up, &frame.view.toward, &frame.centre}) {
        *v = get_vec(in);
    }
    for (double* number : {&frame.left, &frame.top, &frame.near, &frame.depth, &frame.pixel}) {
        *number = in.get<double>();
    }
    frame.width = static_cast<int>(in.get<std::uint32_t>());
    frame.height = static_cast<int>(in.get<std::uint32_t>());
    return frame;
}

void write_part(AtomicFile& file, std::span<const std::byte> payload) {
    std::vector<std::byte> head;
    put(head, static_cast<std::uint64_t>(payload.size()));
    put(head, xxh3_64(payload));
    file.write(head);
    file.write(payload);
}

/// Size and checksum of the part at a place.
struct PartHead {
    std::uint64_t size = 0;
    std::uint64_t checksum = 0;
};

PartHead read_head(const InputFile& file, std::uint64_t at) {
    std::array<std::byte, kPartHeadBytes> bytes{};
    if (file.read_some(at, bytes) != bytes.size()) {
        throw_damaged(file.path(), "all parts");
    }
    ByteReader in(bytes);
    PartHead head;
    head.size = in.get<std::uint64_t>();
    head.checksum = in.get<std::uint64_t>();
    if (head.size > file.size()) {
        throw_damaged(file.path(), "a part that the file has room for");
    }
    return head;
}

void read_payload(const InputFile& file, std::uint64_t at, const PartHead& head,
                  std::span<std::byte> payload) {
    if (head.size != payload.size() ||
        file.read_some(at + kPartHeadBytes, payload) != payload.size() ||
        xxh3_64(payload) != head.checksum) {
        throw_damaged(file.path(), "a part that matches its checksum");
    }
}

InputFile open_scratch(const std::filesystem::path& path) {
    try {
        return InputFile(path);
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

}  // namespace

std::uint64_t CloudDrawing::save(const std::filesystem::path& path) const {
    std::vector<std::byte> facts;
    for (const std::uint64_t count : histogram_.counts()) {
        put(facts, count);
    }
    put_varint(facts, frames_.size());
    for (const Frame& frame : frames_) {
        put_frame(facts, frame);
    }
    AtomicFile file(path, AtomicFile::Durability::kProcess);
    std::vector<std::byte> head;
    for (const char c : kMagic) {
        put(head, c);
    }
    put(head, kVersion);
    file.write(head);
    write_part(file, facts);
    for (const SplatBuffer& buffer : buffers_) {
        write_part(file, std::as_bytes(buffer.pixels()));
    }
    file.commit();
    return file.size();
}

SavedDrawing SavedDrawing::load(const std::filesystem::path& path) {
    const InputFile file = open_scratch(path);
    std::array<std::byte, kHeadBytes> start{};
    if (file.read_some(0, start) != start.size() ||
        std::memcmp(start.data(), kMagic.data(), kMagic.size()) != 0 ||
        std::memcmp(start.data() + kMagic.size(), &kVersion, sizeof kVersion) != 0) {
        throw_damaged(path, "a drawing");
    }
    const PartHead head = read_head(file, kHeadBytes);
    std::vector<std::byte> facts(head.size);
    read_payload(file, kHeadBytes, head, facts);
    ByteReader in(facts);
    std::vector<std::uint64_t> counts(CurvatureScale::kCodes);
    for (std::uint64_t& count : counts) {
        count = in.get<std::uint64_t>();
    }
    std::vector<Frame> frames(std::min<std::uint64_t>(in.get_varint(), in.left()));
    for (Frame& frame : frames) {
        frame = get_frame(in);
    }
    if (!in.ok() || in.left() > 0) {
        throw_damaged(path, "a histogram and frames");
    }
    return {path, CurvatureHistogram(std::move(counts)), std::move(frames)};
}

SplatBuffer SavedDrawing::splats(std::size_t view) const {
    const InputFile file = open_scratch(path);
    std::uint64_t at = kHeadBytes;
    PartHead head = read_head(file, at);
    for (std::size_t i = 0; i <= view; ++i) {
        at += kPartHeadBytes + head.size;
        head = read_head(file, at);
    }
    const Frame& frame = frames[view];
    std::vector<std::uint64_t> pixels(static_cast<std::size_t>(frame.width) *
                                      static_cast<std::size_t>(frame.height));
    read_payload(file, at, head, std::as_writable_bytes(std::span(pixels)));
    return {frame, std::move(pixels)};
}

}  // namespace knap
