#pragma once

/// Marks what libknap shows to programs that link it: the functions and classes of these headers.
#define KNAP_API __attribute__((visibility("default")))
