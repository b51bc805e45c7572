#pragma once

namespace knap::app {

/// From now on the first SIGINT or SIGTERM only sets a flag, so that the job can leave its files in
/// order; a second one ends the process.
void catch_interrupts();

/// Whether a signal has come.
bool interrupted();

/// @throws Interrupted if a signal has come
void throw_if_interrupted();

}  // namespace knap::app
