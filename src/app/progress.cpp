#include "app/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/format.hpp"
#include "app/interrupt.hpp"
#include "knap/error.hpp"

namespace knap::app {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kRedraw = std::chrono::milliseconds(200);
// What is reported as early as this an earlier run has done: it says nothing of the rate.
constexpr auto kTakenUp = std::chrono::milliseconds(100);

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
        rate_from_ = started_;
        points_before_ = 0;
        shown_ = started_;
        show();
    }

    void advance(std::uint64_t points) final {
        throw_if_interrupted();
        points_ += points;
        const Clock::time_point now = Clock::now();
        if (now - started_ < kTakenUp) {
            rate_from_ = now;
            points_before_ = points_;
        }
        if (now - shown_ >= kRedraw) {
            shown_ = now;
            show();
        }
    }

    // Throws nothing: after the last stage the output is there.
    void end(const StageReport& report) final { show_end(report); }

  protected:
    virtual void show() {}
    virtual void show_end(const StageReport& /*report*/) {}

    const std::string& stage() const { return stage_; }
    std::uint64_t total() const { return total_; }
    std::uint64_t points() const { return points_; }
    /// Points a second, without what an earlier run has done; 0 as long as nothing is known of it.
    double rate() const {
        const double seconds = std::chrono::duration<double>(Clock::now() - rate_from_).count();
        return seconds > 0 ? static_cast<double>(points_ - points_before_) / seconds : 0;
    }
    /// Of the stage, at the rate so far; nothing where that or the total is not known.
    std::optional<double> seconds_left(double rate) const {
        if (total_ == 0 || !(rate > 0)) {
            return std::nullopt;
        }
        return static_cast<double>(total_ - std::min(total_, points_)) / rate;
    }

  private:
    std::string stage_;
    std::uint64_t total_ = 0;
    std::uint64_t points_ = 0;
    std::uint64_t points_before_ = 0;
    Clock::time_point started_;
    Clock::time_point rate_from_;
    Clock::time_point shown_;
};

std::string end_line(const StageReport& report) {
    return fmt::format("{:<10} {:>15} points  {:>12}  {:>8} points/s\n", report.name,
                       format_count(report.points), format_seconds(report.seconds),
                       format_rate(static_cast<double>(report.points) / report.seconds));
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
        const double now = rate();
        const std::string per_second = format_rate(now);
        if (total() == 0) {
            return fmt::format("{:>15}  {} points/s", format_count(points()), per_second);
        }
        constexpr double kWidth = 30;
        const double share =
            std::min(1.0, static_cast<double>(points()) / static_cast<double>(total()));
        const auto filled = static_cast<std::size_t>(share * kWidth);
        const std::optional<double> left = seconds_left(now);
        return fmt::format("[{:.<30}] {:>3.0f} %  {} of {}  {} points/s{}",
                           std::string(filled, '#'), share * 100, format_count(points()),
                           format_count(total()), per_second,
                           left ? fmt::format("  {} left", format_seconds(*left)) : "");
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
    void show() override {
        const double now = rate();
        nlohmann::ordered_json line = state(stage(), points(), now);
        const std::optional<double> left = seconds_left(now);
        line["seconds_left"] = left ? nlohmann::ordered_json(*left) : nlohmann::ordered_json();
        print(line);
    }
    void show_end(const StageReport& report) override {
        const double over = report.seconds;
        const double mean = over > 0 ? static_cast<double>(report.points) / over : 0;
        nlohmann::ordered_json line = state(report.name, report.points, mean);
        line["seconds_left"] = 0;
        line["seconds"] = over;
        print(line);
    }

  private:
    nlohmann::ordered_json state(const std::string& name, std::uint64_t done, double now) const {
        return {{"stage", name}, {"points", done}, {"total", total()}, {"points_per_second", now}};
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
