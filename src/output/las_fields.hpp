#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "knap/source.hpp"
#include "output/cloud_writer.hpp"

namespace knap {

/// A value of a point format: a number, or some bits of a byte.
struct LasRecordField {
    const char* name;
    ScalarType type;         ///< bits: kUint8
    std::size_t offset = 0;  ///< in the record
    unsigned shift = 0;      ///< bits only
    unsigned width = 0;      ///< bits only; 0: not bits
};

/// Where each attribute of a cloud goes in the records of a LAS file.
///
/// An attribute that has the name of a field of the point format, and a type that the field holds,
/// goes there; all others become extra bytes. Of the point formats without waveforms the one with
/// the shortest record that has all fields is taken: 0 to 3 where every LAS source had one of 0 to
/// 5, else 6 to 8.
class LasFields {
  public:
    /// @throws ConfigError if a record would be longer than 65535 bytes
    explicit LasFields(const CloudHeader& header);

    int version_minor() const { return version_minor_; }  ///< of LAS 1.n
    int point_format() const { return point_format_; }    ///< 0 to 3, 6 to 8
    std::uint16_t record_length() const { return record_length_; }

    /// Place of an attribute in a record.
    struct Place {
        std::optional<LasRecordField> field;  ///< none: extra bytes
        std::size_t offset = 0;               ///< of extra bytes, in the record
    };
    const std::vector<Place>& places() const { return places_; }  ///< one for each attribute

    /// The return number and the number of returns, bits of byte 14 of the record.
    unsigned return_bits() const { return point_format_ >= 6 ? 4 : 3; }

    /// True if nothing tells the returns of a point: then each has one.
    bool without_returns() const { return without_returns_; }

    /// Content of the record that describes the extra bytes; empty if there are none.
    std::vector<std::byte> extra_bytes_record() const;

    /// What LAS cannot say as it is.
    const std::vector<std::string>& notes() const { return notes_; }

  private:
    void choose_format(const CloudHeader& header);
    void place_all();
    void tell(const CloudHeader& header);

    std::vector<Attribute> attributes_;
    int version_minor_ = 4;
    int point_format_ = 6;
    std::uint16_t record_length_ = 0;
    bool without_returns_ = false;
    std::vector<Place> places_;
    std::vector<std::string> notes_;
};

}  // namespace knap
