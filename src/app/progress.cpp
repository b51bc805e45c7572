#include "app/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "app/format.hpp"
#include "app/interrupt.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kRedraw = std::chrono::milliseconds(200);

/// Follows the stage that runs; by itself it shows nothing.
class Follower : public Progress {
  public:
    Follower() { catch_interrupts(); }

    void begin(std::string_view stage, std::uint64_t total) final {
        throw_if_interrupted();
        stage_ = stage;
        total_ = total;
        points_ = 0;
        started_ = Clock::now();
        shown_ = started_;
        show();
    }

    void advance(std::uint64_t points) final {
        throw_if_interrupted();
        points_ += points;
        const Clock::time_point now = Clock::now();
        if (now - shown_ >= kRedraw) {
            shown_ = now;
            show();
        }
    }

    void end(const StageReport& report) final {
        throw_if_interrupted();
        show_end(report);
    }

  protected:
    virtual void show() {}
    virtual void show_end(const StageReport& /*report*/) {}

    const std::string& stage() const { return stage_; }
    std::uint64_t total() const { return total_; }
    std::uint64_t points() const { return points_; }
    double seconds() const {
        return std::chrono::duration<double>(Clock::now() - started_).count();
    }

  private:
    std::string stage_;
    std::uint64_t total_ = 0;
    std::uint64_t points_ = 0;
    Clock::time_point started_;
    Clock::time_point shown_;
};

std::string end_line(const StageReport& report) {
    return fmt::format("{:<10} {:>15} points  {:>12}  {:>8} points/s\n", report.name,
                       format_count(report.points), format_seconds(report.seconds),
                       format_rate(report.points, report.seconds));
}

/// A line for each finished stage.
class Lines : public Follower {
  public:
    void note(std::string_view message) override { fmt::print(stderr, "knap: {}\n", message); }

  protected:
    void show_end(const StageReport& report) override {
        fmt::print(stderr, "{}", end_line(report));
    }
};

/// A bar that is redrawn in its line, on a terminal.
class Bars : public Follower {
  public:
    ~Bars() override { clear(); }
    void note(std::string_view message) override {
        clear();
        fmt::print(stderr, "knap: {}\n", message);
    }

  protected:
    void show() override {
        fmt::print(stderr, "\r\033[K{:<10} {}", stage(), bar());
        std::fflush(stderr);
        drawn_ = true;
    }
    void show_end(const StageReport& report) override {
        clear();
        fmt::print(stderr, "{}", end_line(report));
    }

  private:
    void clear() {
        if (drawn_) {
            std::fputs("\r\033[K", stderr);  // does not throw: the destructor comes here too
            std::fflush(stderr);
            drawn_ = false;
        }
    }

    std::string bar() const {
        const std::string rate = format_rate(points(), seconds());
        if (total() == 0) {
            return fmt::format("{:>15}  {} points/s", format_count(points()), rate);
        }
        constexpr double kWidth = 30;
        const double share =
            std::min(1.0, static_cast<double>(points()) / static_cast<double>(total()));
        const auto filled = static_cast<std::size_t>(share * kWidth);
        return fmt::format("[{:.<30}] {:>3.0f} %  {} of {}  {} points/s", std::string(filled, '#'),
                           share * 100, format_count(points()), format_count(total()), rate);
    }

    bool drawn_ = false;
};

/// A JSON object a line, for programs; the last one of a stage has its "seconds" too.
class JsonLines : public Follower {
  public:
    void note(std::string_view message) override {
        print(nlohmann::ordered_json{{"note", std::string(message)}});
    }

  protected:
    void show() override { print(state(stage(), points(), seconds())); }
    void show_end(const StageReport& report) override {
        nlohmann::ordered_json line = state(report.name, report.points, report.seconds);
        line["seconds"] = report.seconds;
        print(line);
    }

  private:
    nlohmann::ordered_json state(const std::string& name, std::uint64_t done, double time) const {
        const double rate = time > 0 ? static_cast<double>(done) / time : 0;
        return {{"stage", name}, {"points", done}, {"total", total()}, {"points_per_second", rate}};
    }
    static void print(const nlohmann::ordered_json& line) {
        using Json = nlohmann::ordered_json;
        fmt::print(stderr, "{}\n", line.dump(-1, ' ', false, Json::error_handler_t::replace));
    }
};

}  // namespace

std::unique_ptr<Progress> make_progress(const ProgressOptions& options) {
    if (options.mode != "auto" && options.mode != "plain" && options.mode != "json") {
        throw ConfigError(
            fmt::format("--progress: expected auto, plain or json, found \"{}\"", options.mode));
    }
    if (options.quiet) {
        return std::make_unique<Follower>();
    }
    if (options.mode == "json") {
        return std::make_unique<JsonLines>();
    }
    if (options.mode == "auto" && ::isatty(STDERR_FILENO) == 1) {
        return std::make_unique<Bars>();
    }
    return std::make_unique<Lines>();
}

}  // namespace knap::app
