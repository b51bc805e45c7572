#include "report/report_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "report/error_section.hpp"
#include "report/html.hpp"
#include "report/log_bars.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::Not;

class PageTest : public testing::Test {
  protected:
    PageTest() {
        job_.range.alpha = 0.25;
        SourceEntry source;
        source.given_path = "<b>&\"scan\".ply";
        source.points = 1234567;
        source.info.size_bytes = 1 << 20;
        table_ = SourceTable({source}, box());
        report_.counts = {1234567, 100001, 1130000, 4500, 66};
        report_.output = "<i>out";
        report_.spacing = 0.05;
        report_.output_bytes = 4321;
        report_.stages = {{"survey", 1.5, 2.5, 1234567}};
        std::mt19937_64 random(1);
        std::lognormal_distribution<double> curvature(0, 1);
        for (int i = 0; i < 10000; ++i) {
            all_.add(scale_.code_of(curvature(random)));
        }
        kept_.add(scale_.code_of(3));
    }

    static Box box() {
        Box box;
        box.extend(Vec3{0, 0, 0});
        box.extend(Vec3{1, 2, 3});
        return box;
    }

    std::string page() const {
        return format_report_page(
            {.job = job_,
             .report = report_,
             .sources = table_,
             .scale = scale_,
             .all = all_,
             .kept = kept_,
             .colours = CurvatureColours::of(all_),
             .range_of = [](double curvature) { return 0.25 / curvature; },
             .views = {{"from <above>", 2, 2, {std::byte{1}}, {std::byte{2}}, {std::byte{3}}}}});
    }

    Job job_;
    Report report_;
    SourceTable table_;
    CurvatureScale scale_{1.0};
    CurvatureHistogram all_;
    CurvatureHistogram kept_;
};

TEST_F(PageTest, HasAllCountsAsASum) {
    const std::string text = page();
    std::size_t at = text.find("id=\"counts\"");
    for (const char* count : {"1,234,567", "100,001", "1,130,000", "4,500", "66"}) {
        at = text.find(count, at);
        ASSERT_NE(at, std::string::npos) << count;
    }
}

TEST_F(PageTest, EscapesWhatUsersNamed) {
    const std::string text = page();
    EXPECT_THAT(text, HasSubstr("&lt;b&gt;&amp;&quot;scan&quot;.ply"));
    EXPECT_THAT(text, HasSubstr("<h1>&lt;i&gt;out</h1>"));
    EXPECT_THAT(text, HasSubstr("from &lt;above&gt;"));
    EXPECT_THAT(text, Not(HasSubstr("<b>&\"")));
}

TEST_F(PageTest, AsksForNothingOutsideItself) {
    const std::string text = page();
    for (const char* outside :
         {"http:", "https:", "//cdn", "<script", "<link", "@import", "url(h"}) {
        EXPECT_THAT(text, Not(HasSubstr(outside)));
    }
    EXPECT_THAT(text, HasSubstr("src=\"data:image/png;base64,AQ==\""));
}

TEST_F(PageTest, HasEveryParameterWithItsValue) {
    const std::string text = page();
    for (const Parameter& parameter : parameters()) {
        if (parameter.key != "input") {
            EXPECT_THAT(text, HasSubstr(std::string(parameter.key) + "</code>"));
        }
    }
    EXPECT_THAT(text, HasSubstr("<code>range.alpha</code></th><td class=\"path\">0.25</td>"));
}

TEST_F(PageTest, TheErrorIsPutInAndReplaced) {
    const std::string before = page();
    EXPECT_THAT(before, HasSubstr("Not measured"));
    MeasuredError error{"a<b.ply", 777, 0.001, 0.002, 0.005, 0.0123, 10, 0.05};
    const std::string once = replace_error_section(before, error).value();
    EXPECT_THAT(once, Not(HasSubstr("Not measured")));
    EXPECT_THAT(once, HasSubstr("0.0123"));
    EXPECT_THAT(once, HasSubstr("a&lt;b.ply"));
    error.max = 0.0456;
    const std::string twice = replace_error_section(once, error).value();
    EXPECT_THAT(twice, HasSubstr("0.0456"));
    EXPECT_THAT(twice, Not(HasSubstr("0.0123")));
    EXPECT_EQ(twice.size(), once.size());
    EXPECT_EQ(replace_error_section("<html></html>", error), std::nullopt);
}

TEST(Html, TextIsNoMarkupAndAlwaysUtf8) {
    EXPECT_EQ(escape_html("a<b>&'\""), "a&lt;b&gt;&amp;&#39;&quot;");
    EXPECT_EQ(escape_html("\xC3\xA9t\xC3\xA9 \xF0\x9F\x97\xBF"),
              "\xC3\xA9t\xC3\xA9 \xF0\x9F\x97\xBF");
    EXPECT_EQ(escape_html("\xFFz\xC3"), "\xEF\xBF\xBDz\xEF\xBF\xBD");
    EXPECT_EQ(escape_html("\xED\xA0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD") << "a surrogate";
    EXPECT_EQ(escape_html("a\nb\x01"), "a b ");
}

TEST(Html, Base64IsThatOfTheStandard) {
    const auto encoded = [](std::string_view text) {
        return data_uri("t", std::as_bytes(std::span(text)));
    };
    EXPECT_EQ(encoded(""), "data:t;base64,");
    EXPECT_EQ(encoded("f"), "data:t;base64,Zg==");
    EXPECT_EQ(encoded("fo"), "data:t;base64,Zm8=");
    EXPECT_EQ(encoded("foobar"), "data:t;base64,Zm9vYmFy");
}

TEST(LogBars, HoldEveryPointOnce) {
    std::mt19937_64 random(2);
    std::lognormal_distribution<double> curvature(0, 2);
    const CurvatureScale scale(1);
    CurvatureHistogram all;
    CurvatureHistogram kept;
    for (int i = 0; i < 5000; ++i) {
        const std::uint32_t code = scale.code_of(i % 10 == 0 ? 0 : curvature(random));
        all.add(code);
        if (i % 3 == 0) {
            kept.add(code);
        }
    }
    const LogBars bars = log_bars(
        scale, all, kept, [](double c) { return 1 / c; }, 4);
    std::uint64_t in_all = bars.outside.all;
    std::uint64_t in_kept = bars.outside.kept;
    for (std::size_t i = 0; i < bars.bars.size(); ++i) {
        in_all += bars.bars[i].all;
        in_kept += bars.bars[i].kept;
        EXPECT_TRUE(i == 0 || bars.bars[i].from == bars.bars[i - 1].to);
    }
    EXPECT_EQ(in_all, 5000U);
    EXPECT_EQ(in_kept, kept.points());
    EXPECT_EQ(bars.outside.all, 500U);
}

TEST(LogBars, OfPointsWithoutCurvatureAreToldInWords) {
    const CurvatureScale flat(0);
    CurvatureHistogram all;
    all.add(flat.code_of(0));
    const LogBars bars = log_bars(
        flat, all, {}, [](double c) { return c; }, 4);
    EXPECT_TRUE(bars.bars.empty());
    EXPECT_THAT(format_chart(bars, {"curvature", "1 / unit"}), HasSubstr("no point has one"));
}

TEST(CurvatureScale, IsTrueToHalfAPercent) {
    const CurvatureScale scale(3.7);
    for (double curvature = 1e-3; curvature < 1e4; curvature *= 1.37) {
        EXPECT_NEAR(scale.curvature_of(scale.code_of(curvature)) / curvature, 1, 0.005);
    }
    EXPECT_EQ(scale.code_of(0), 0U);
    EXPECT_EQ(scale.code_of(1e300), CurvatureScale::kCodes - 1);
}

}  // namespace
}  // namespace knap
