#include "input/ply_binary_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "base/scalar.hpp"
#include "input/buffered_reader.hpp"
#include "input/bytes.hpp"
#include "input/columns.hpp"
#include "input/coordinates.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

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
        locate_properties();
        reader_.seek(header_.data_offset);
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
    }
    bool read(Chunk& chunk, std::size_t max_points) override;
    void seek(std::uint64_t index) override;

  private:
    void check_size() const;
    void locate_properties();
    void start();
    void finish();
    void skip_element(const PlyElement& element);
    void read_fixed(Chunk& chunk);
    void read_variable(Chunk& chunk);
    void read_columns(const std::byte* records, std::size_t n, Chunk& chunk, std::size_t done);
    void take_value(const std::byte* value, std::size_t attribute, Chunk& chunk, std::size_t point);

    /// Goes over a list whose length is next.
    void skip_list(const PlyElement& element, const PlyProperty& property, std::uint64_t instance);

    InputFile file_;
    PlyHeader header_;
    SourceInfo info_;
    BufferedReader reader_;
    bool swap_;
    std::vector<std::size_t> offsets_;  // of the values of the schema in a record without lists
    ColumnSelection selection_;
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
    if (exact && left > 0 && file_.size_known()) {
        throw InputError(fmt::format(
            "{}: expected the file to end at byte {} after the last element, found {} bytes more",
            file_.path().string(), file_.size() - left, left));
    }
}

void BinaryPlySource::locate_properties() {
    offsets_.reserve(info_.schema.size());
    std::size_t offset = 0;
    for (const Attribute& attribute : info_.schema) {
        offsets_.push_back(offset);
        offset += attribute.value_size();
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
    if (!reader_.at_end()) {
        throw InputError(fmt::format(
            "{}: expected the file to end at byte {} after the last element, found {} bytes more",
            file_.path().string(), reader_.offset(),
            file_.size_known() ? fmt::to_string(reader_.remaining()) : "some"));
    }
    finished_ = true;
}

void BinaryPlySource::read_columns(const std::byte* records, std::size_t n, Chunk& chunk,
                                   std::size_t done) {
    const std::size_t stride = header_.vertices().stride();
    for (std::size_t column = 0; column < selection_.size(); ++column) {
        copy_values(records + offsets_[selection_.attribute(column)], stride, n,
                    selection_.at(chunk, column, done), selection_.value_size(column), swap_);
    }
}

void BinaryPlySource::read_fixed(Chunk& chunk) {
    const std::size_t stride = header_.vertices().stride();
    // Blocks small enough that the passes over one find it in the cache.
    constexpr std::size_t kBlockBytes = 16384;
    const std::size_t block = std::max<std::size_t>(1, kBlockBytes / stride);
    for (std::size_t done = 0; done < chunk.positions.size();) {
        const std::size_t n = std::min(block, chunk.positions.size() - done);
        const std::byte* records = reader_.take(n * stride);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t from = info_.axes[axis];
            decode_coordinate(records + offsets_[from], stride, n, chunk.positions.data() + done,
                              static_cast<int>(axis), info_.schema[from].type, swap_);
        }
        read_columns(records, n, chunk, done);
        done += n;
    }
}

/// Puts one value of the schema where it is wanted.
void BinaryPlySource::take_value(const std::byte* value, std::size_t attribute, Chunk& chunk,
                                 std::size_t point) {
    const ScalarType type = info_.schema[attribute].type;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (info_.axes[axis] == attribute) {
            decode_coordinate(value, 0, 1, &chunk.positions[point], static_cast<int>(axis), type,
                              swap_);
        }
    }
    for (std::size_t column = 0; column < selection_.size(); ++column) {
        if (selection_.attribute(column) == attribute) {
            copy_values(value, 0, 1, selection_.at(chunk, column, point), size_of(type), swap_);
        }
    }
}

void BinaryPlySource::read_variable(Chunk& chunk) {
    const PlyElement& vertices = header_.vertices();
    for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
        std::size_t attribute = 0;
        for (const PlyProperty& property : vertices.properties) {
            if (property.list_count) {
                skip_list(vertices, property, next_ + i);
            } else {
                take_value(reader_.take(size_of(property.type)), attribute++, chunk, i);
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
    selection_.resize(chunk, chunk.positions.size());
    if (left == 0) {
        if (!finished_) {
            finish();
        }
        return false;
    }
    if (header_.vertices().fixed_size()) {
        read_fixed(chunk);
    } else {
        read_variable(chunk);
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
