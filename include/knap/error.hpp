#pragma once

#include <stdexcept>

#include "knap/export.hpp"

/// The three ways a job can fail. Each message names the file or key, what was expected, what was
/// found and where; it is one line.
namespace knap {

/// Base of all errors that knap throws.
class KNAP_API Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// A parameter, job file or command line is wrong. The user can mend it.
class KNAP_API ConfigError : public Error {
  public:
    using Error::Error;
};

/// An input file is missing, malformed or truncated.
class KNAP_API InputError : public Error {
  public:
    using Error::Error;
};

/// The machine failed: disk, memory, or a file of knap's own that no longer matches its checksum.
class KNAP_API StorageError : public Error {
  public:
    using Error::Error;
};

/// The job was stopped from outside (Ctrl-C). Thrown by whatever the progress observer throws it
/// from.
class KNAP_API Interrupted : public Error {
  public:
    using Error::Error;
};

}  // namespace knap
