#include "input/laz_chunk_table.hpp"

#include <algorithm>
#include <array>

namespace knap {

namespace {

// Constants of the coder; the format fixes them.
constexpr std::uint32_t kShortestInterval = std::uint32_t{1} << 24;
constexpr unsigned kSymbolShift = 15;
constexpr unsigned kBitShift = 13;
constexpr std::uint32_t kOne = std::uint32_t{1} << 31;

/// Frequencies of an alphabet, learnt from the symbols seen.
class SymbolModel {
  public:
    explicit SymbolModel(std::uint32_t symbols)
        : counts_(symbols, 1), cumulated_(symbols), cycle_(symbols) {
        rescale();
        cycle_ = until_rescale_ = (symbols + 6) / 2;
    }

    std::span<const std::uint32_t> cumulated() const { return cumulated_; }

    void saw(std::uint32_t symbol) {
        ++counts_[symbol];
        if (--until_rescale_ == 0) {
            rescale();
        }
    }

  private:
    void rescale() {
        constexpr std::uint32_t kLargestTotal = std::uint32_t{1} << kSymbolShift;
        total_ += cycle_;
        if (total_ > kLargestTotal) {
            total_ = 0;
            for (std::uint32_t& count : counts_) {
                count = (count + 1) / 2;
                total_ += count;
            }
        }
        const std::uint32_t scale = kOne / total_;
        std::uint32_t sum = 0;
        for (std::size_t i = 0; i < counts_.size(); ++i) {
            cumulated_[i] = (scale * sum) >> (31 - kSymbolShift);
            sum += counts_[i];
        }
        const auto longest_cycle = static_cast<std::uint32_t>((counts_.size() + 6) * 8);
        cycle_ = until_rescale_ = std::min(5 * cycle_ / 4, longest_cycle);
    }

    std::vector<std::uint32_t> counts_;
    std::vector<std::uint32_t> cumulated_;
    std::uint32_t total_ = 0;
    std::uint32_t cycle_;
    std::uint32_t until_rescale_ = 0;
};

/// The same for a single bit.
class BitModel {
  public:
    std::uint32_t zero_probability() const { return zero_probability_; }

    void saw(bool bit) {
        zeros_ += bit ? 0 : 1;
        if (--until_rescale_ == 0) {
            rescale();
        }
    }

  private:
    void rescale() {
        constexpr std::uint32_t kLargestTotal = std::uint32_t{1} << kBitShift;
        constexpr std::uint32_t kLongestCycle = 64;
        total_ += cycle_;
        if (total_ > kLargestTotal) {
            total_ = (total_ + 1) / 2;
            zeros_ = (zeros_ + 1) / 2;
            total_ += zeros_ == total_ ? 1 : 0;
        }
        zero_probability_ = (zeros_ * (kOne / total_)) >> (31 - kBitShift);
        cycle_ = until_rescale_ = std::min(5 * cycle_ / 4, kLongestCycle);
    }

    std::uint32_t zeros_ = 1;
    std::uint32_t total_ = 2;
    std::uint32_t zero_probability_ = std::uint32_t{1} << (kBitShift - 1);
    std::uint32_t cycle_ = 4;
    std::uint32_t until_rescale_ = 4;
};

class ArithmeticDecoder {
  public:
    explicit ArithmeticDecoder(std::span<const std::byte> coded) : coded_(coded) {
        for (int i = 0; i < 4; ++i) {
            value_ = (value_ << 8) | next_byte();
        }
    }

    /// More bytes were asked for than there are.
    bool exhausted() const { return exhausted_; }

    std::uint32_t symbol(SymbolModel& model) {
        const std::span<const std::uint32_t> cumulated = model.cumulated();
        const std::uint32_t unit = length_ >> kSymbolShift;
        const auto above = std::ranges::upper_bound(cumulated, value_, {},
                                                    [unit](std::uint32_t c) { return c * unit; });
        // The first share begins at 0, so that something lies below.
        const auto symbol = static_cast<std::uint32_t>(above - cumulated.begin()) - 1;
        const std::uint32_t low = cumulated[symbol] * unit;
        narrow(low, (above == cumulated.end() ? length_ : *above * unit) - low);
        model.saw(symbol);
        return symbol;
    }

    bool bit(BitModel& model) {
        const std::uint32_t zero = model.zero_probability() * (length_ >> kBitShift);
        const bool bit = value_ >= zero;
        narrow(bit ? zero : 0, bit ? length_ - zero : zero);
        model.saw(bit);
        return bit;
    }

    /// An evenly distributed number of `bits` <= 24 bits.
    std::uint32_t bits(unsigned bits) {
        constexpr unsigned kMostAtOnce = 19;
        if (bits > kMostAtOnce) {
            const std::uint32_t low = even(16);
            return low | (even(bits - 16) << 16);
        }
        return even(bits);
    }

  private:
    std::uint32_t even(unsigned bits) {
        const std::uint32_t unit = length_ >> bits;
        const std::uint32_t drawn = value_ / unit;
        narrow(drawn * unit, unit);
        return drawn;
    }

    void narrow(std::uint32_t low, std::uint32_t length) {
        value_ -= low;
        // An empty interval comes from damaged bytes only; it must not stop the loop from ending.
        length_ = std::max<std::uint32_t>(length, 1);
        while (length_ < kShortestInterval) {
            value_ = (value_ << 8) | next_byte();
            length_ <<= 8;
        }
    }

    std::uint32_t next_byte() {
        exhausted_ = exhausted_ || position_ >= coded_.size();
        return exhausted_ ? 0 : std::to_integer<std::uint32_t>(coded_[position_++]);
    }

    std::span<const std::byte> coded_;
    std::size_t position_ = 0;
    bool exhausted_ = false;
    std::uint32_t value_ = 0;
    std::uint32_t length_ = 0xffffffff;
};

/// 32-bit integers as corrections to a prediction: the magnitude class of the correction first,
/// then its place in the class, whose high bits are modelled and whose low bits are even.
class IntegerDecoder {
  public:
    IntegerDecoder() {
        for (unsigned k = 1; k < kBits; ++k) {
            places_.emplace_back(std::uint32_t{1} << std::min(k, kModelledBits));
        }
    }

    std::uint32_t decode(ArithmeticDecoder& from, std::uint32_t prediction, std::size_t context) {
        return prediction + correction(from, classes_[context]);
    }

  private:
    static constexpr unsigned kBits = 32;
    static constexpr unsigned kModelledBits = 8;

    std::uint32_t correction(ArithmeticDecoder& from, SymbolModel& classes) {
        const std::uint32_t k = from.symbol(classes);
        if (k == 0) {
            return from.bit(zero_or_one_) ? 1 : 0;
        }
        if (k >= kBits) {
            return kOne;
        }
        std::uint32_t place = from.symbol(places_[k - 1]);
        if (k > kModelledBits) {
            const unsigned rest = k - kModelledBits;
            place = (place << rest) | from.bits(rest);
        }
        // The upper half of a class is positive: 2^(k-1)+1 .. 2^k; the lower: -(2^k-1) .. -2^(k-1).
        return place >= (std::uint32_t{1} << (k - 1)) ? place + 1
                                                      : place - ((std::uint32_t{1} << k) - 1);
    }

    std::array<SymbolModel, 2> classes_{SymbolModel(kBits + 1), SymbolModel(kBits + 1)};
    std::vector<SymbolModel> places_;
    BitModel zero_or_one_;
};

}  // namespace

std::vector<LazTableEntry> decode_laz_chunk_table(std::span<const std::byte> coded,
                                                  std::uint32_t chunks, bool with_counts) {
    ArithmeticDecoder decoder(coded);
    IntegerDecoder integers;
    std::vector<LazTableEntry> entries;
    entries.reserve(chunks);
    LazTableEntry entry;
    for (std::uint32_t i = 0; i < chunks; ++i) {
        if (with_counts) {
            entry.points = integers.decode(decoder, entry.points, 0);
        }
        entry.bytes = integers.decode(decoder, entry.bytes, 1);
        if (decoder.exhausted()) {
            break;
        }
        entries.push_back(entry);
    }
    return entries;
}

}  // namespace knap
