#pragma once

#include "base/file.hpp"

namespace knap {

/// Does the file begin as a gzip file does?
bool is_gzip(const InputFile& file);

/// The file read as what it decompresses to, in ascending order: a place before the last one is
/// reached by starting again. Memory does not depend on the size.
///
/// Reading it throws InputError if it is damaged or ends early, members one after the other and
/// zeros behind them being fine.
InputFile gunzip(InputFile file);

/// Did gunzip() make this?
inline bool is_gunzipped(const InputFile& file) {
    return !file.size_known();
}

}  // namespace knap
