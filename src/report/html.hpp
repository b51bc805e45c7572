#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace knap {

/// Text as HTML shows it, in elements and attributes: <, >, & and quotes are no markup. Bytes that
/// are not UTF-8 become U+FFFD, control characters spaces.
std::string escape_html(std::string_view text);

/// Bytes as a page carries them within itself: "data:image/png;base64,...".
std::string data_uri(std::string_view type, std::span<const std::byte> bytes);

}  // namespace knap
