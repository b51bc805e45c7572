#pragma once

#include "knap/error.hpp"

namespace knap {

/// What `read` gives, of a scratch file: one that cannot be read is the machine's fault, not the
/// input's.
/// @throws StorageError in place of InputError
template <typename Read>
auto as_scratch(const Read& read) {
    try {
        return read();
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

}  // namespace knap
