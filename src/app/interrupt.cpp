#include "app/interrupt.hpp"

#include <csignal>

#include "knap/error.hpp"

namespace knap::app {

namespace {

// A signal handler reaches nothing else.
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t signalled = 0;

extern "C" void remember_signal(int /*signal*/) {
    signalled = 1;
}

}  // namespace

void catch_interrupts() {
    struct sigaction action {};
    action.sa_handler = remember_signal;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
    return signalled != 0;
}

void throw_if_interrupted() {
    if (interrupted()) {
        throw Interrupted("interrupted by a signal; nothing was written to the output");
    }
}

}  // namespace knap::app
