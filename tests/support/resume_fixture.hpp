#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/archive_bytes.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"

/// A job of many bricks that is stopped and taken up again.
namespace knap::test {

/// Stops a job at its n-th call, or never.
class Stopper final : public Progress {
  public:
    explicit Stopper(std::int64_t calls) : left_(calls) {}
    void begin(std::string_view stage, std::uint64_t /*total*/) override {
        stages_.emplace_back(stage);
        count();
    }
    void advance(std::uint64_t /*points*/) override { count(); }
    void note(std::string_view message) override { notes_.emplace_back(message); }

    std::int64_t calls() const { return calls_; }
    const std::vector<std::string>& notes() const { return notes_; }
    const std::vector<std::string>& stages() const { return stages_; }

  private:
    void count() {
        ++calls_;
        if (left_-- == 0) {
            throw Interrupted("stopped");
        }
    }

    std::int64_t left_;
    std::int64_t calls_ = 0;
    std::vector<std::string> notes_;
    std::vector<std::string> stages_;
};

inline constexpr std::int64_t kNever = std::int64_t{1} << 60;

class ResumeFixture : public testing::Test {
  protected:
    ResumeFixture() {
        const std::vector<Vec3> cloud = sphere_cloud(8000, 3);
        write_ply(folder_ / "in.ply", {cloud.begin(), cloud.begin() + 5000}, true);
        write_ascii_ply(folder_ / "text.ply", {cloud.begin() + 5000, cloud.end()});
        job_.input = {(folder_ / "in.ply").string(), (folder_ / "text.ply").string()};
        job_.range.alpha = 0.05;
        job_.output.path = (folder_ / "out").string();
        job_.output.ids = (folder_ / "ids").string();
        job_.output.overwrite = true;
        job_.output.tile_points = 1000;
        job_.resources.memory_bytes = std::uint64_t{512} << 20;
        job_.resources.threads = 2;
        job_.resources.brick_points = 100;
    }

    Report run_whole() {
        Stopper never(kNever);
        return run(job_, never);
    }

    /// The scratch folder that an unfinished run left.
    std::filesystem::path scratch() const {
        for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
            if (entry.path().filename().string().starts_with("knap-out-")) {
                return entry.path();
            }
        }
        return {};
    }

    std::vector<std::filesystem::path> scratch_files(const std::string& ending) const {
        std::vector<std::filesystem::path> files;
        for (const auto& entry : std::filesystem::directory_iterator(scratch())) {
            if (entry.path().extension() == ending) {
                files.push_back(entry.path());
            }
        }
        std::sort(files.begin(), files.end());
        return files;
    }

    /// Flips a bit.
    static void damage(std::mt19937_64& random, const std::filesystem::path& file) {
        std::string bytes = read_bytes(file);
        bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
        write_bytes(file, bytes);
    }

    std::string result() const {
        return archive_bytes(folder_ / "out") + read_bytes(folder_ / "ids");
    }

    TemporaryFolder folder_;
    Job job_;
};

// Leaves an unfinished run that has got into a stage.
inline void stop_in(const Job& job, const std::string& stage, int calls = 1) {
    class InStage final : public Progress {
      public:
        InStage(std::string stage, int calls) : stage_(std::move(stage)), left_(calls) {}
        void begin(std::string_view stage, std::uint64_t /*total*/) override {
            inside_ = stage == stage_;
        }
        void advance(std::uint64_t /*points*/) override {
            if (inside_ && left_-- == 0) {
                throw Interrupted("stopped");
            }
        }

      private:
        std::string stage_;
        int left_;
        bool inside_ = false;
    };
    InStage stopper(stage, calls);
    EXPECT_THAT([&] { run(job, stopper); }, testing::ThrowsMessage<Interrupted>(
                                                testing::HasSubstr("the same command goes on")));
}

}  // namespace knap::test
