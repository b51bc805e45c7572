#include "app/options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "app/suggest.hpp"
#include "app/value.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap::app {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

Job parse(JobOptions::Input input, const std::vector<std::string>& arguments) {
    CLI::App command;
    const JobOptions options(command, input);
    // CLI11 takes the arguments from the back.
    command.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    return options.job();
}

Job simplify_job(const std::vector<std::string>& arguments) {
    return parse(JobOptions::Input::kFiles, arguments);
}

TEST(Value, NumbersAreReadWhole) {
    EXPECT_EQ(parse_number("0.4", "--x"), 0.4);
    EXPECT_EQ(parse_number("1e-3", "--x"), 1e-3);
    EXPECT_EQ(parse_number("inf", "--x"), HUGE_VAL);
    for (const char* text :
         {"", "nan", "abc", "1e400", "0,4", "0.4mm", " 1", "1 ", "+-1", "0x10"}) {
        EXPECT_THAT([&] { parse_number(text, "--alpha"); },
                    ThrowsMessage<ConfigError>(HasSubstr("--alpha: expected a number")))
            << text;
    }
}

TEST(Value, CountsAreWholeAndNotNegative) {
    EXPECT_EQ(parse_count("0", "--n"), 0U);
    EXPECT_EQ(parse_count("18446744073709551615", "--n"), ~std::uint64_t{0});
    for (const char* text : {"", "-1", "1.5", "1e6", "18446744073709551616", "ten"}) {
        EXPECT_THROW(parse_count(text, "--n"), ConfigError) << text;
    }
}

TEST(Value, SizesTakeBinaryUnits) {
    EXPECT_EQ(parse_size("1024", "--memory"), 1024U);
    EXPECT_EQ(parse_size("1KiB", "--memory"), 1024U);
    EXPECT_EQ(parse_size("1.5GiB", "--memory"), std::uint64_t{3} << 29);
    EXPECT_EQ(parse_size("2TiB", "--memory"), std::uint64_t{2} << 40);
    for (const char* text :
         {"", "GiB", "4GB", "-1GiB", "4 GiB", "nanGiB", "infGiB", "9999999999TiB", "1.5"}) {
        EXPECT_THROW(parse_size(text, "--memory"), ConfigError) << text;
    }
}

TEST(Suggest, FindsWhatWasMeant) {
    EXPECT_THAT([] { find_parameter("range.alhpa", "--set"); },
                ThrowsMessage<ConfigError>(HasSubstr("did you mean range.alpha?")));
    EXPECT_THAT([] { find_parameter("memory", "--set"); },
                ThrowsMessage<ConfigError>(HasSubstr("did you mean resources.memory?")));
    EXPECT_EQ(&find_parameter("input", "--set"), &parameters().front());
}

TEST(JobOptions, EveryParameterHasItsFlag) {
    const Job job = simplify_job({"a.ply",
                                  "b.ply",
                                  "--estimator",
                                  "quadric",
                                  "--neighbours",
                                  "20",
                                  "--samples",
                                  "16",
                                  "--sample-step",
                                  "0.5",
                                  "--law",
                                  "chord",
                                  "--alpha",
                                  "0.4",
                                  "--tolerance",
                                  "0.5",
                                  "--ratio",
                                  "0.6",
                                  "--count",
                                  "7",
                                  "--min-factor",
                                  "0.1",
                                  "--max-factor",
                                  "inf",
                                  "--slab",
                                  "0.2",
                                  "--aspect",
                                  "2",
                                  "--repair",
                                  "0.1",
                                  "--keep",
                                  "classification == 2",
                                  "--flag",
                                  "--measures",
                                  "--discount-noise",
                                  "-o",
                                  "out",
                                  "--step",
                                  "0.001",
                                  "--tile-points",
                                  "5000",
                                  "--attributes",
                                  "intensity,red",
                                  "--encoding",
                                  "kd",
                                  "--ids",
                                  "ids.txt",
                                  "--overwrite",
                                  "--report",
                                  "--tileset",
                                  "--memory",
                                  "1GiB",
                                  "--threads",
                                  "3",
                                  "--scratch",
                                  "/tmp",
                                  "--brick-points",
                                  "12345"});
    EXPECT_THAT(job.input, ElementsAre("a.ply", "b.ply"));
    const Job defaults;
    for (const Parameter& parameter : parameters()) {
        EXPECT_NE(format_value(parameter, job), format_value(parameter, defaults)) << parameter.key;
    }
    EXPECT_EQ(job.range.max_factor, HUGE_VAL);
    EXPECT_THAT(job.output.attributes, ElementsAre("intensity", "red"));
    EXPECT_EQ(job.resources.memory_bytes, std::uint64_t{1} << 30);
}

TEST(JobOptions, ATargetOnTheCommandLineTakesThePlaceOfThatOfTheFile) {
    const test::TemporaryFolder folder;
    write_text_file(folder / "job.toml", "range.alpha = 0.5\n");
    const auto job = [&](const std::vector<std::string>& arguments) {
        std::vector<std::string> all{(folder / "job.toml").string()};
        all.insert(all.end(), arguments.begin(), arguments.end());
        return parse(JobOptions::Input::kJob, all);
    };
    EXPECT_EQ(job({}).range.alpha, 0.5);
    EXPECT_EQ(job({"--count", "7"}).range.alpha, 0);
    EXPECT_EQ(job({"--count", "7"}).range.count, 7U);
    EXPECT_EQ(job({"--set", "range.ratio=0.1"}).range.alpha, 0);
    EXPECT_EQ(job({"--alpha", "2"}).range.alpha, 2);
    EXPECT_EQ(job({"--neighbours", "7"}).range.alpha, 0.5);
}

TEST(JobOptions, AFlagMayBeTakenBack) {
    const auto discounts = [](const std::vector<std::string>& flags) {
        std::vector<std::string> all{"--preset", "accurate", "--alpha", "2"};
        all.insert(all.end(), flags.begin(), flags.end());
        return simplify_job(all).curvature.discount_noise;
    };
    EXPECT_TRUE(discounts({}));
    EXPECT_TRUE(discounts({"--discount-noise"}));
    EXPECT_TRUE(discounts({"--discount-noise=true"}));
    EXPECT_FALSE(discounts({"--discount-noise=false"}));
}

TEST(JobOptions, AttributesAreAllNoneOrNames) {
    const auto attributes = [](const std::string& text) {
        return simplify_job({"--attributes", text}).output.attributes;
    };
    EXPECT_THAT(simplify_job({}).output.attributes, ElementsAre("all"));
    EXPECT_THAT(attributes("none"), ElementsAre("none"));
    EXPECT_THAT(attributes("a b,c"), ElementsAre("a b", "c"));
    for (const char* text : {"", ",", "a,", "all,a", "a,none"}) {
        EXPECT_THAT([&] { attributes(text); },
                    ThrowsMessage<ConfigError>(HasSubstr("expected all, none, or names")))
            << text;
    }
}

TEST(JobOptions, APathMayHaveACommaInIt) {
    const test::TemporaryFolder folder;
    write_text_file(folder / "job.toml", "");
    const std::string file = (folder / "job.toml").string();
    EXPECT_THAT(parse(JobOptions::Input::kJob, {file, "--set", "input=a,b.ply"}).input,
                ElementsAre("a,b.ply"));
}

TEST(JobOptions, APresetIsWhatOtherFlagsChange) {
    const Job job = simplify_job({"--neighbours", "25", "--preset", "accurate", "--alpha", "2"});
    EXPECT_EQ(job.curvature.estimator, Estimator::kQuadric);
    EXPECT_EQ(job.curvature.neighbours, 25);
    EXPECT_EQ(job.range.law, RangeLawKind::kChord);
    EXPECT_EQ(job.range.max_factor, 3);
    EXPECT_EQ(job.range.alpha, 2);
    EXPECT_EQ(simplify_job({"--preset", "paper"}).range.max_factor, HUGE_VAL);
    EXPECT_THAT(
        [] {
            simplify_job({"--preset", "best"});
        },
        ThrowsMessage<ConfigError>(HasSubstr("--preset: expected paper or accurate")));
}

TEST(JobOptions, WithoutFlagsAJobIsTheDefaults) {
    const Job job = simplify_job({});
    for (const Parameter& parameter : parameters()) {
        EXPECT_EQ(format_value(parameter, job), format_value(parameter, Job{}));
    }
}

TEST(JobOptions, AWrongValueNamesTheFlag) {
    EXPECT_THAT(
        [] {
            simplify_job({"--alpha", "abc"});
        },
        ThrowsMessage<ConfigError>(HasSubstr("--alpha: expected a number, found \"abc\"")));
    EXPECT_THAT(
        [] {
            simplify_job({"--alpha", "-1"});
        },
        ThrowsMessage<ConfigError>(HasSubstr("found -1")));
}

TEST(JobOptions, FlagsWinOverSetWhichWinsOverTheFile) {
    const test::TemporaryFolder folder;
    const std::string file = (folder / "job.toml").string();
    write_text_file(file,
                    "input = [\"a\"]\n[range]\nalpha = 1\nmin_factor = 0.1\nmax_factor = 2\n");
    const Job job = parse(JobOptions::Input::kJob,
                          {file, "--set", "range.alpha=3", "--set", "range.min_factor=0.2",
                           "--alpha", "4", "--input", "b", "--input", "c"});
    EXPECT_EQ(job.range.alpha, 4);
    EXPECT_EQ(job.range.min_factor, 0.2);
    EXPECT_EQ(job.range.max_factor, 2);
    EXPECT_THAT(job.input, ElementsAre("b", "c"));
    EXPECT_EQ(parse(JobOptions::Input::kJobOrFiles, {file}).range.alpha, 1);
}

TEST(JobOptions, PlanTakesFilesToo) {
    EXPECT_THAT(parse(JobOptions::Input::kJobOrFiles, {"a.ply", "b.laz"}).input,
                ElementsAre("a.ply", "b.laz"));
}

TEST(OutputFile, IsCheckedBeforeTheWork) {
    const test::TemporaryFolder folder;
    const std::string file = (folder / "out.ply").string();
    EXPECT_NO_THROW(check_output_file({file, false}));
    write_text_file(file, "here");
    EXPECT_THAT(
        [&] {
            check_output_file({file, false});
        },
        ThrowsMessage<ConfigError>(HasSubstr("exists (needs --overwrite)")));
    EXPECT_NO_THROW(check_output_file({file, true}));
    EXPECT_THROW(check_output_file({folder.path().string(), true}), ConfigError);
    EXPECT_THROW(check_output_file({(folder / "none/out.ply").string(), true}), ConfigError);
    EXPECT_THROW(check_output_file({"", true}), ConfigError);
}

}  // namespace
}  // namespace knap::app
