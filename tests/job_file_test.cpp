#include "app/job_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "base/file.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap::app {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::ThrowsMessage;

class JobFile : public testing::Test {
  protected:
    Job read(const std::string& text) const {
        write_text_file(folder_ / "job.toml", text);
        return read_job_file(folder_ / "job.toml");
    }

    template <typename Matcher>
    void expect_error(const std::string& text, const Matcher& message) const {
        EXPECT_THAT([&] { read(text); },
                    ThrowsMessage<ConfigError>(AllOf(message, Not(HasSubstr("\n")))))
            << text;
    }

    test::TemporaryFolder folder_;
};

TEST_F(JobFile, EveryKeyIsRead) {
    const Job job = read(R"(
input = ["a.ply", "folder"]
[curvature]
estimator = "quadric"
neighbours = 20
samples = 16
step = 0.5
[range]
law = "chord"
alpha = 0.4
tolerance = 0.5
ratio = 0.6
count = 7
min_factor = 0.1
max_factor = inf
[output]
path = "out"
step = 0.001
tile_points = 5000
ids = "ids.txt"
overwrite = true
report = true
[resources]
memory = "1.5GiB"
threads = 3
scratch = "/tmp"
brick_points = 12345
)");
    EXPECT_THAT(job.input, ElementsAre("a.ply", "folder"));
    EXPECT_EQ(job.curvature.estimator, Estimator::kQuadric);
    EXPECT_EQ(job.curvature.neighbours, 20);
    EXPECT_EQ(job.curvature.samples, 16);
    EXPECT_EQ(job.curvature.step, 0.5);
    EXPECT_EQ(job.range.law, RangeLawKind::kChord);
    EXPECT_EQ(job.range.alpha, 0.4);
    EXPECT_EQ(job.range.tolerance, 0.5);
    EXPECT_EQ(job.range.ratio, 0.6);
    EXPECT_EQ(job.range.count, 7U);
    EXPECT_EQ(job.range.min_factor, 0.1);
    EXPECT_EQ(job.range.max_factor, HUGE_VAL);
    EXPECT_EQ(job.output.path, "out");
    EXPECT_EQ(job.output.step, 0.001);
    EXPECT_EQ(job.output.tile_points, 5000U);
    EXPECT_EQ(job.output.ids, "ids.txt");
    EXPECT_TRUE(job.output.overwrite);
    EXPECT_TRUE(job.output.report);
    EXPECT_EQ(job.resources.memory_bytes, std::uint64_t{3} << 29);
    EXPECT_EQ(job.resources.threads, 3);
    EXPECT_EQ(job.resources.scratch, "/tmp");
    EXPECT_EQ(job.resources.brick_points, 12345U);
}

TEST_F(JobFile, AnEmptyFileIsTheDefaults) {
    const Job job = read("");
    for (const Parameter& parameter : parameters()) {
        EXPECT_EQ(format_value(parameter, job), format_value(parameter, Job{}));
    }
}

TEST_F(JobFile, AnIntegerIsTakenWhereANumberIsWanted) {
    EXPECT_EQ(read("range.alpha = 2").range.alpha, 2.0);
}

TEST_F(JobFile, MemoryIsTakenAsBytesToo) {
    EXPECT_EQ(read("resources.memory = 1073741824").resources.memory_bytes, std::uint64_t{1} << 30);
}

TEST_F(JobFile, AnUnknownKeyIsNamedWithItsLineAndTheNearestKey) {
    expect_error("input = [\"a\"]\n\n[range]\nalhpa = 1\n",
                 EndsWith("job.toml:4: unknown key range.alhpa; did you mean range.alpha?"));
    expect_error("alpha = 1", HasSubstr(":1: unknown key alpha; did you mean range.alpha?"));
    expect_error("[rnage]\nalpha = 1", HasSubstr("rnage.alpha; did you mean range.alpha?"));
    expect_error("\nrange = 3", HasSubstr(":2: unknown key range; did you mean range."));
    expect_error("[outptu]\n", HasSubstr("unknown key outptu; did you mean output."));
}

TEST_F(JobFile, TheFirstWrongLineIsReported) {
    expect_error("[range]\nzeta = 1\n[curvature]\nbeta = 2\n", HasSubstr(":2: unknown key"));
}

TEST_F(JobFile, AWrongTypeIsNamedWithWhatWasExpectedAndFound) {
    expect_error("[range]\nalpha = \"x\"",
                 EndsWith(":2: range.alpha: expected a number, found the text \"x\""));
    expect_error("range.alpha = true", HasSubstr("expected a number, found true"));
    expect_error("range.alpha = [1]", HasSubstr("expected a number, found a list"));
    expect_error("range.alpha = 2024-01-01", HasSubstr("expected a number, found a date"));
    expect_error("[range.alpha]\nx = 1", HasSubstr("expected a number, found a table"));
    expect_error("input = \"a.ply\"", HasSubstr("expected a list of text, found the text"));
    expect_error("input = [\"a\", 3]", HasSubstr("found a list with an integer in it"));
    expect_error("resources.threads = 1.5", HasSubstr("expected an integer, found the number"));
    expect_error("resources.threads = 4294967297", HasSubstr("expected an integer, found"));
    expect_error("resources.brick_points = -1", HasSubstr("expected an integer >= 0, found"));
    expect_error("resources.memory = \"4GB\"", HasSubstr("expected a size such as 4GiB"));
    expect_error("range.law = 2", HasSubstr("expected the name of one, found the integer 2"));
    expect_error("range.law = \"cord\"", EndsWith("range.law: expected reciprocal or chord, "
                                                  "found \"cord\""));
    expect_error("output.overwrite = \"yes\"", HasSubstr("expected true or false, found"));
}

TEST_F(JobFile, AValueOutOfRangeIsNamedWithItsLine) {
    expect_error("[range]\nalpha = -1",
                 AllOf(HasSubstr("job.toml:2: range.alpha"), EndsWith("found -1")));
    expect_error("[range]\nalpha = 0", HasSubstr("found 0"));
    expect_error("[range]\nalpha = nan", HasSubstr("found nan"));
    expect_error("curvature.samples = 5", HasSubstr("even"));
    expect_error("resources.memory = \"1MiB\"", HasSubstr(">= 256MiB, found 1MiB"));
}

TEST_F(JobFile, WhatIsNoTomlIsNamedWithItsLine) {
    expect_error("input = [\"a\"]\n[range\n", HasSubstr("job.toml:2:"));
    expect_error("range.alpha = 1e400", HasSubstr("job.toml:1:"));
    expect_error("range.alpha = 1\nrange.alpha = 2", HasSubstr("job.toml:2:"));
    expect_error("x = \"\xff\"", HasSubstr("job.toml:1:"));
}

TEST_F(JobFile, AMissingFileIsNamed) {
    EXPECT_THAT([&] { read_job_file(folder_ / "none.toml"); },
                ThrowsMessage<InputError>(HasSubstr("none.toml")));
}

TEST(Configs, EachParsesAndIsValid) {
    for (const char* name : {"quickstart.toml", "paper.toml", "accurate.toml", "archive.toml"}) {
        Job job;
        ASSERT_NO_THROW(job = read_job_file(std::filesystem::path(KNAP_CONFIGS) / name)) << name;
        EXPECT_NO_THROW(validate(job)) << name;
    }
}

TEST(Configs, PaperHasNoUpperBound) {
    const Job job = read_job_file(std::filesystem::path(KNAP_CONFIGS) / "paper.toml");
    EXPECT_EQ(job.range.max_factor, HUGE_VAL);
    EXPECT_EQ(job.range.min_factor, 1.0 / 3);
}

TEST(Configs, SayWhatTheirPresetsDo) {
    for (const std::string name : {"paper", "accurate"}) {
        const Job job = read_job_file(std::filesystem::path(KNAP_CONFIGS) / (name + ".toml"));
        Job preset;
        apply_preset(preset, name);
        for (const Parameter& parameter : parameters()) {
            if (!parameter.target &&
                (parameter.key.starts_with("curvature.") || parameter.key.starts_with("range."))) {
                EXPECT_EQ(format_value(parameter, job), format_value(parameter, preset))
                    << name << ": " << parameter.key;
            }
        }
    }
}

TEST(Configs, ArchiveHasEveryKeyUnderAComment) {
    const std::string text = read_text_file(std::filesystem::path(KNAP_CONFIGS) / "archive.toml");
    for (const Parameter& parameter : parameters()) {
        const std::string key(parameter.key);
        const std::size_t dot = key.find('.');
        const std::size_t section =
            dot == std::string::npos ? 0 : text.find("\n[" + key.substr(0, dot) + "]\n");
        ASSERT_NE(section, std::string::npos) << key;
        const std::string name = dot == std::string::npos ? key : key.substr(dot + 1);
        std::size_t line = text.find("\n" + name + " = ", section);
        if (line == std::string::npos && parameter.target) {
            line = text.find("\n# " + name + " = ", section);  // in place of another
        }
        ASSERT_NE(line, std::string::npos) << key;
        const std::size_t above = text.rfind('\n', line - 1);
        EXPECT_EQ(text[above + 1], '#') << key << " has no comment";
    }
}

}  // namespace
}  // namespace knap::app
