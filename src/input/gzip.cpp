#include "input/gzip.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::array kSignature{std::byte{0x1f}, std::byte{0x8b}};

class GzipContent final : public DecodedContent {
  public:
    explicit GzipContent(InputFile file) : file_(std::move(file)), input_(kBuffer) {
        constexpr int kGzipOnly = 16;
        if (inflateInit2(&stream_, MAX_WBITS + kGzipOnly) != Z_OK) {
            throw StorageError(
                fmt::format("{}: no memory to decompress it", file_.path().string()));
        }
    }
    ~GzipContent() override { inflateEnd(&stream_); }
    GzipContent(const GzipContent&) = delete;
    GzipContent& operator=(const GzipContent&) = delete;

    std::size_t read_some(std::uint64_t offset, std::span<std::byte> buffer) override {
        if (offset < produced_) {
            restart();
        }
        while (produced_ < offset) {
            scrap_.resize(kBuffer);
            const auto ahead = std::min<std::uint64_t>(offset - produced_, scrap_.size());
            if (produce(std::span(scrap_).first(static_cast<std::size_t>(ahead))) == 0) {
                return 0;
            }
        }
        std::size_t total = 0;
        while (total < buffer.size()) {
            const std::size_t got = produce(buffer.subspan(total));
            if (got == 0) {
                break;
            }
            total += got;
        }
        return total;
    }

  private:
    static constexpr std::size_t kBuffer = std::size_t{1} << 18;

    void restart() {
        inflateReset(&stream_);
        stream_.avail_in = 0;
        consumed_ = 0;
        produced_ = 0;
        between_members_ = false;
        ended_ = false;
    }

    /// Has more input for the decoder; false at the end of the file.
    bool refill() {
        if (stream_.avail_in > 0) {
            return true;
        }
        const std::size_t got = file_.read_some(consumed_, input_);
        consumed_ += got;
        stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
        stream_.avail_in = static_cast<uInt>(got);
        return got > 0;
    }

    /// Decompresses some bytes; 0 at the end.
    std::size_t produce(std::span<std::byte> out) {
        // Larger counts than a decoder takes at once would not fit it.
        out = out.first(std::min<std::size_t>(out.size(), std::size_t{1} << 30U));
        stream_.next_out = reinterpret_cast<Bytef*>(out.data());
        stream_.avail_out = static_cast<uInt>(out.size());
        while (!ended_ && stream_.avail_out == out.size()) {
            if (!refill()) {
                if (!between_members_) {
                    fail("its end");
                }
                ended_ = true;
            } else if (between_members_) {
                begin_member();
            } else {
                inflate_some();
            }
        }
        const std::size_t got = out.size() - stream_.avail_out;
        produced_ += got;
        return got;
    }

    void inflate_some() {
        const int status = inflate(&stream_, Z_NO_FLUSH);
        if (status == Z_STREAM_END) {
            between_members_ = true;
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            fail(stream_.msg != nullptr ? stream_.msg : "damage");
        }
    }

    /// Behind a member there is another, or zeros that fill up a block.
    void begin_member() {
        if (*stream_.next_in == 0) {
            ++stream_.next_in;
            --stream_.avail_in;
            return;
        }
        inflateReset(&stream_);
        between_members_ = false;
    }

    [[noreturn]] void fail(const char* found) const {
        throw InputError(fmt::format("{}: expected gzip data, found {} before byte {}",
                                     file_.path().string(), found, consumed_ - stream_.avail_in));
    }

    InputFile file_;
    z_stream stream_{};
    std::vector<std::byte> input_;
    std::vector<std::byte> scrap_;
    std::uint64_t consumed_ = 0;  // bytes of the file read
    std::uint64_t produced_ = 0;  // bytes decompressed
    bool between_members_ = false;
    bool ended_ = false;
};

}  // namespace

bool is_gzip(const InputFile& file) {
    std::array<std::byte, kSignature.size()> head{};
    return file.read_some(0, head) == head.size() && head == kSignature;
}

InputFile gunzip(InputFile file) {
    InputFile again(file.path());
    return {std::move(file), std::make_unique<GzipContent>(std::move(again))};
}

}  // namespace knap
