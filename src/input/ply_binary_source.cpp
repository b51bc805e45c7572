#include "input/ply_binary_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "base/scalar.hpp"
#include "input/buffered_reader.hpp"
#include "input/bytes.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::array<double Vec3::*, 3> kAxisMembers{&Vec3::x, &Vec3::y, &Vec3::z};

template <typename T, bool kSwap>
void decode_axis(const std::byte* from, std::size_t stride, std::size_t n, Vec3* to,
                 double Vec3::*axis) {
    for (std::size_t i = 0; i < n; ++i) {
        to[i].*axis = static_cast<double>(load<T, kSwap>(from + i * stride));
    }
}

void decode_axis(const std::byte* from, std::size_t stride, std::size_t n, Vec3* to,
                 double Vec3::*axis, ScalarType type, bool swap) {
    visit_scalar(type, [&](auto tag) {
        using T = typename decltype(tag)::Type;
        swap ? decode_axis<T, true>(from, stride, n, to, axis)
             : decode_axis<T, false>(from, stride, n, to, axis);
    });
}

class BinaryPlySource final : public PointSource {
  public:
    BinaryPlySource(InputFile file, PlyHeader header, SourceInfo info)
        : file_(std::move(file)),
          header_(std::move(header)),
          info_(std::move(info)),
          reader_(file_),
          swap_((header_.encoding == PlyEncoding::kLittleEndian) !=
                (std::endian::native == std::endian::little)) {
        check_size();
        locate_axes();
        reader_.seek(header_.data_offset);
    }

    const SourceInfo& info() const override { return info_; }

    bool read(Chunk& chunk, std::size_t max_points) override;
    void seek(std::uint64_t index) override;

  private:
    void check_size() const;
    void locate_axes();
    void start();
    void finish();
    void skip_element(const PlyElement& element);
    void read_fixed(std::span<Vec3> positions);
    void read_variable(std::span<Vec3> positions);

    /// Goes over a list whose length is next.
    void skip_list(const PlyElement& element, const PlyProperty& property, std::uint64_t instance);

    InputFile file_;
    PlyHeader header_;
    SourceInfo info_;
    BufferedReader reader_;
    bool swap_;
    std::array<std::size_t, 3> axis_offsets_{};  // in a record without lists
    std::uint64_t next_ = 0;
    bool started_ = false;
    bool finished_ = false;
};

void BinaryPlySource::check_size() const {
    std::uint64_t left = file_.size() - header_.data_offset;
    bool exact = true;
    for (const PlyElement& element : header_.elements) {
        const std::size_t stride = element.stride();
        if (stride > BufferedReader::kCapacity) {
            throw InputError(fmt::format(
                "{}: expected at most {} bytes in one element '{}', found {}",
                file_.path().string(), BufferedReader::kCapacity, element.name, stride));
        }
        if (stride > 0 && element.count > left / stride) {
            throw InputError(
                fmt::format("{}: the data ends early: expected {} of element '{}' of at least {} "
                            "bytes each, found "
                            "{} bytes at byte {}",
                            file_.path().string(), element.count, element.name, stride, left,
                            file_.size() - left));
        }
        left -= element.count * stride;
        exact = exact && (element.count == 0 || element.fixed_size());
    }
    if (exact && left > 0) {
        throw InputError(fmt::format(
            "{}: expected the file to end at byte {} after the last element, found {} bytes more",
            file_.path().string(), file_.size() - left, left));
    }
}

void BinaryPlySource::locate_axes() {
    const std::vector<PlyProperty>& properties = header_.vertices().properties;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < header_.axes[axis]; ++i) {
            axis_offsets_[axis] += size_of(properties[i].type);
        }
    }
}

void BinaryPlySource::skip_list(const PlyElement& element, const PlyProperty& property,
                                std::uint64_t instance) {
    const std::uint64_t place = reader_.offset();
    const std::byte* from = reader_.take(size_of(*property.list_count));
    // A negative length becomes one beyond any file.
    const std::uint64_t length = visit_scalar(*property.list_count, [&](auto tag) {
        using T = typename decltype(tag)::Type;
        return static_cast<std::uint64_t>(swap_ ? load<T, true>(from) : load<T, false>(from));
    });
    if (length > reader_.remaining() / size_of(property.type)) {
        throw InputError(
            fmt::format("{}: at byte {}: expected a list '{}' that fits in the {} bytes left, "
                        "found {} items in {} {}",
                        file_.path().string(), place, property.name, reader_.remaining(), length,
                        element.name, instance));
    }
    reader_.skip(length * size_of(property.type));
}

void BinaryPlySource::skip_element(const PlyElement& element) {
    if (element.fixed_size()) {
        reader_.skip(element.count * element.stride());
        return;
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const PlyProperty& property : element.properties) {
            if (property.list_count) {
                skip_list(element, property, i);
            } else {
                reader_.take(size_of(property.type));
            }
        }
    }
}

void BinaryPlySource::start() {
    for (std::size_t i = 0; i < header_.vertex; ++i) {
        skip_element(header_.elements[i]);
    }
    started_ = true;
}

void BinaryPlySource::finish() {
    for (std::size_t i = header_.vertex + 1; i < header_.elements.size(); ++i) {
        skip_element(header_.elements[i]);
    }
    if (reader_.remaining() > 0) {
        throw InputError(fmt::format(
            "{}: expected the file to end at byte {} after the last element, found {} bytes more",
            file_.path().string(), reader_.offset(), reader_.remaining()));
    }
    finished_ = true;
}

void BinaryPlySource::read_fixed(std::span<Vec3> positions) {
    const std::vector<PlyProperty>& properties = header_.vertices().properties;
    const std::size_t stride = header_.vertices().stride();
    // Blocks small enough that the three passes over one find it in the cache.
    constexpr std::size_t kBlockBytes = 16384;
    const std::size_t block = std::max<std::size_t>(1, kBlockBytes / stride);
    for (std::size_t done = 0; done < positions.size();) {
        const std::size_t n = std::min(block, positions.size() - done);
        const std::byte* records = reader_.take(n * stride);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            decode_axis(records + axis_offsets_[axis], stride, n, positions.data() + done,
                        kAxisMembers[axis], properties[header_.axes[axis]].type, swap_);
        }
        done += n;
    }
}

void BinaryPlySource::read_variable(std::span<Vec3> positions) {
    const PlyElement& vertices = header_.vertices();
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (std::size_t p = 0; p < vertices.properties.size(); ++p) {
            const PlyProperty& property = vertices.properties[p];
            if (property.list_count) {
                skip_list(vertices, property, next_ + i);
                continue;
            }
            const std::byte* value = reader_.take(size_of(property.type));
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (header_.axes[axis] == p) {
                    decode_axis(value, 0, 1, &positions[i], kAxisMembers[axis], property.type,
                                swap_);
                }
            }
        }
    }
}

bool BinaryPlySource::read(Chunk& chunk, std::size_t max_points) {
    if (!started_) {
        start();
    }
    const std::uint64_t left = header_.vertices().count - next_;
    chunk.first = next_;
    chunk.positions.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left, max_points)));
    if (left == 0) {
        if (!finished_) {
            finish();
        }
        return false;
    }
    if (header_.vertices().fixed_size()) {
        read_fixed(chunk.positions);
    } else {
        read_variable(chunk.positions);
    }
    next_ += chunk.positions.size();
    return true;
}

void BinaryPlySource::seek(std::uint64_t index) {
    if (info_.seek_granularity == 0 || index > header_.vertices().count) {
        throw InputError(fmt::format("{}: cannot seek to point {} of {}", file_.path().string(),
                                     index, header_.vertices().count));
    }
    std::uint64_t offset = header_.data_offset;
    for (std::size_t i = 0; i < header_.vertex; ++i) {
        offset += header_.elements[i].count * header_.elements[i].stride();
    }
    reader_.seek(offset + index * header_.vertices().stride());
    next_ = index;
    started_ = true;
    finished_ = false;
}

}  // namespace

std::unique_ptr<PointSource> open_binary_ply(InputFile file, PlyHeader header, SourceInfo info) {
    return std::make_unique<BinaryPlySource>(std::move(file), std::move(header), std::move(info));
}

}  // namespace knap
