#include "knap/params.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "knap/error.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

Job valid_job() {
    Job job;
    job.input = {"cloud.ply"};
    job.range.alpha = 0.4;
    job.output.path = "archive";
    return job;
}

const Parameter& row(std::string_view key) {
    for (const Parameter& parameter : parameters()) {
        if (parameter.key == key) {
            return parameter;
        }
    }
    throw std::logic_error(std::string(key));
}

TEST(Params, DefaultsWithInputAlphaAndOutputAreValid) {
    EXPECT_NO_THROW(validate(valid_job()));
}

TEST(Params, EveryKeyAndFlagIsNamedOnce) {
    std::set<std::string_view> keys;
    std::set<std::string_view> flags;
    for (const Parameter& parameter : parameters()) {
        EXPECT_TRUE(keys.insert(parameter.key).second) << parameter.key;
        EXPECT_TRUE(flags.insert(parameter.flag).second) << parameter.flag;
        EXPECT_FALSE(parameter.range.empty()) << parameter.key;
        EXPECT_FALSE(parameter.help.empty()) << parameter.key;
    }
}

TEST(Params, EveryKeyReachesAFieldOfItsOwn) {
    Job job;
    std::set<const void*> fields;
    for (const Parameter& parameter : parameters()) {
        const void* address = std::visit(
            [](auto field) -> const void* {
                if constexpr (std::is_same_v<decltype(field), Bytes> ||
                              std::is_same_v<decltype(field), Choice>) {
                    return field.value;
                } else {
                    return field;
                }
            },
            parameter.field(job));
        EXPECT_TRUE(fields.insert(address).second) << parameter.key;
    }
}

TEST(Params, ARequiredKeyThatIsMissingIsNamed) {
    Job job = valid_job();
    job.input.clear();
    EXPECT_THAT([&] { validate(job); }, ThrowsMessage<ConfigError>(HasSubstr("input")));
}

TEST(Params, OneTargetIsGivenAndOnlyOne) {
    Job job = valid_job();
    job.range.alpha = 0;
    EXPECT_THAT([&] { validate(job); },
                ThrowsMessage<ConfigError>(AllOf(HasSubstr("range.alpha (--alpha)"),
                                                 HasSubstr("range.count (--count)"),
                                                 HasSubstr("found none"))));
    job.range.count = 5;
    EXPECT_NO_THROW(validate(job));
    job.range.ratio = 0.5;
    EXPECT_THAT([&] { validate(job); },
                ThrowsMessage<ConfigError>(HasSubstr("found --ratio and --count")));
    job.range = {.tolerance = 0.1};
    EXPECT_THAT([&] { validate(job); }, ThrowsMessage<ConfigError>(HasSubstr("quadric")));
    job.curvature.estimator = Estimator::kQuadric;
    EXPECT_THAT([&] { validate(job); }, ThrowsMessage<ConfigError>(HasSubstr("chord")));
    job.range.law = RangeLawKind::kChord;
    EXPECT_NO_THROW(validate(job));
    job.range.tolerance = -1;
    EXPECT_THAT([&] { validate(job); }, ThrowsMessage<ConfigError>(HasSubstr("range.tolerance")));
}

TEST(Params, ANumberOutsideItsRangeIsNamedWithRangeAndValue) {
    for (const double alpha : {-1.0, std::nan(""), HUGE_VAL, -HUGE_VAL}) {
        Job job = valid_job();
        job.range.alpha = alpha;
        EXPECT_THAT([&] { validate(job); },
                    ThrowsMessage<ConfigError>(
                        AllOf(HasSubstr("range.alpha"), HasSubstr("> 0"),
                              HasSubstr("found " + format_value(row("range.alpha"), job)))));
    }
}

TEST(Params, EveryNumberIsRefusedJustOutsideAndTakenJustInside) {
    for (const Parameter& parameter : parameters()) {
        Job job = valid_job();
        const ParameterField field = parameter.field(job);
        if (double* const* number = std::get_if<double*>(&field)) {
            **number = parameter.high;
            EXPECT_NO_THROW(validate(parameter, job)) << parameter.key;
            **number = parameter.low;
            if (parameter.low_open) {
                EXPECT_THROW(validate(parameter, job), ConfigError) << parameter.key;
            } else {
                EXPECT_NO_THROW(validate(parameter, job)) << parameter.key;
            }
            **number = std::nextafter(parameter.low, -HUGE_VAL);
            EXPECT_THROW(validate(parameter, job), ConfigError) << parameter.key;
            **number = std::nan("");
            EXPECT_THROW(validate(parameter, job), ConfigError) << parameter.key;
        } else if (int* const* integer = std::get_if<int*>(&field)) {
            for (const double bound : {parameter.low, parameter.high}) {
                **integer = static_cast<int>(bound);
                EXPECT_NO_THROW(validate(parameter, job)) << parameter.key;
            }
            **integer = static_cast<int>(parameter.low) - 1;
            EXPECT_THROW(validate(parameter, job), ConfigError) << parameter.key;
            **integer = static_cast<int>(parameter.high) + 1;
            EXPECT_THROW(validate(parameter, job), ConfigError) << parameter.key;
        }
    }
}

TEST(Params, AnInfiniteRangeIsAllowed) {
    Job job = valid_job();
    job.range.max_factor = HUGE_VAL;
    EXPECT_NO_THROW(validate(job));
}

TEST(Params, SamplesMustBeEven) {
    Job job = valid_job();
    job.curvature.samples = 5;
    EXPECT_THAT([&] { validate(job); }, ThrowsMessage<ConfigError>(HasSubstr("even")));
}

TEST(Params, WhatTheResultDependsOnIsMarked) {
    for (const Parameter& parameter : parameters()) {
        EXPECT_FALSE(parameter.in_result && parameter.key.starts_with("resources."))
            << parameter.key;
        EXPECT_TRUE(parameter.in_result || !(parameter.key.starts_with("curvature.") ||
                                             parameter.key.starts_with("range.")))
            << parameter.key;
    }
}

TEST(Params, SizesAreWrittenWithTheLargestWholeUnit) {
    Job job;
    const auto written = [&](std::uint64_t bytes) {
        job.resources.memory_bytes = bytes;
        return format_value(row("resources.memory"), job);
    };
    EXPECT_EQ(written(std::uint64_t{4} << 30), "4GiB");
    EXPECT_EQ(written(std::uint64_t{1536} << 20), "1536MiB");
    EXPECT_EQ(written(1025), "1025");
    EXPECT_EQ(written(0), "0");
}

}  // namespace
}  // namespace knap
