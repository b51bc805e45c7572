#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::input_error_of;
using test::read_all;
using test::ScanFolder;
using test::shared_data;
using testing::HasSubstr;

const std::vector<Vec3> kTwo{{1, 2.5, -3}, {4e3, 0.5, 6}};

TEST(Text, ReadsEverySeparatorAndLineEnd) {
    const ScanFolder folder;
    for (const std::string separator : {" ", "   ", "\t", ",", ", ", ";", " ; ", "\t \t"}) {
        for (const std::string end : {"\n", "\r\n", "\r"}) {
            const std::string s = separator;
            const std::string text =
                "1" + s + "2.5" + s + "-3" + s + "9" + end + "4e3" + s + ".5" + s + "+6" + s + "9";
            EXPECT_EQ(read_all(folder.write("a.xyz", text)), kTwo) << separator;
            EXPECT_EQ(read_all(folder.write("a.xyz", text + end)), kTwo) << separator;
            EXPECT_EQ(read_all(folder.write("a.xyz", "  " + text + end + end), 1), kTwo)
                << separator;
        }
    }
}

TEST(Text, FindsColumnsByNameInAHeader) {
    const ScanFolder folder;
    const std::string rows = "7,-3,1,2.5\n7,6,4e3,.5\n";
    for (const std::string header :
         {"id,z,x,y", "ID,Z,X,Y", "\"id\",\"Z\",\"X\",\"Y\"", ",z,x,y", "\"a,b\", z ,x,y"}) {
        const auto path = folder.write("a.csv", header + "\n" + rows);
        EXPECT_EQ(read_all(path), kTwo) << header;
        EXPECT_EQ(open_source(path)->info().schema[1].name,
                  header.find('z') != std::string::npos ? "z" : "Z");
    }
    EXPECT_EQ(read_all(folder.write("a.txt", "\xef\xbb\xbfX Y Z\n1 2.5 -3\n4e3 .5 6\n")), kTwo);
    EXPECT_EQ(
        read_all(folder.write("b.csv", "x;y;z;name\n\"1\";\"2.5\";\"-3\";\"a;b\"\n4e3;.5;6;\n")),
        kTwo);
}

TEST(Text, SkipsCommentsBlankLinesAndATitle) {
    const ScanFolder folder;
    EXPECT_EQ(read_all(folder.write(
                  "a.xyz", "# a\n//X Y Z\n\n1 2.5 -3 # here\n  # b\n\n4e3 .5 6 // there\n#")),
              kTwo);
    EXPECT_EQ(read_all(folder.write("a.xyz", "exported by someone else\n1 2.5 -3\n4e3 .5 6\n")),
              kTwo);
}

TEST(Text, APtsCountIsHeldAgainstTheData) {
    const ScanFolder folder;
    const auto path = folder.write("a.pts", "2\n1 2.5 -3 -100 1 2 3\n4e3 .5 6 -100 1 2 3\n");
    EXPECT_EQ(read_all(path), kTwo);
    const auto source = open_source(path);
    EXPECT_EQ(source->info().format, "PTS (text)");
    EXPECT_EQ(source->info().schema[3].name, "intensity");
    EXPECT_EQ(read_all(folder.write("b.pts", "0\n")).size(), 0U);
    EXPECT_THAT(input_error_of(folder.write("c.pts", "3\n1 2 3\n4 5 6\n")),
                HasSubstr("expected 3 points as line 1 says, found 2"));
}

TEST(Text, APtsFileMayHoldMoreThanItsCount) {
    const ScanFolder folder;
    EXPECT_EQ(read_all(folder.write("a.pts", "1\n1 2.5 -3\n4e3 .5 6\n")), kTwo);
    EXPECT_EQ(read_all(folder.write("b.pts", "1\n1 2.5 -3\n1\n4e3 .5 6\n")), kTwo);
    EXPECT_THAT(input_error_of(folder.write("c.pts", "1\n1 2 3\n2\n4 5 6\n")),
                HasSubstr("expected 3 points as line 3 says, found 2"));
    EXPECT_THAT(input_error_of(folder.write("d.pts", "1\n1 2 3\n4 5 6\n1\n7 8 9\n")),
                HasSubstr("line 4: expected 3 columns, found 1"));
}

TEST(Text, NamesMayStandInAComment) {
    const ScanFolder folder;
    const auto names_of = [&](const std::string& content) {
        std::string names;
        const auto source = open_source(folder.write("a.xyz", content));
        for (const Attribute& attribute : source->info().schema) {
            names += attribute.name + " ";
        }
        return names;
    };
    EXPECT_EQ(names_of("# made by hand\n\n//X Y Z R\n1 2 3 4\n"), "X Y Z R ");
    EXPECT_EQ(names_of("# r,x,y,z\n1,2,3,4\n#a,b,c,d\n"), "r x y z ");
    EXPECT_EQ(names_of("//X Y Z R\n1\n1 2 3 4\n"), "X Y Z R ");
    EXPECT_EQ(names_of("# x y z of a site\n1 2 3 4\n"), "x y z column4 ");
    EXPECT_EQ(names_of("# east north up r\n1 2 3 4\n"), "x y z column4 ");
    EXPECT_EQ(read_all(folder.write("b.xyz", "# z y x\n-3 2.5 1\n6 .5 4e3\n")), kTwo);
}

TEST(Text, NumbersDoNotDependOnTheLocale) {
    const ScanFolder folder;
    const std::string before = std::setlocale(LC_ALL, nullptr);
    std::setlocale(LC_ALL, "de_DE.UTF-8");
    EXPECT_EQ(read_all(folder.write("a.xyz", "1 2.5 -3\n4e3 .5 6\n")), kTwo);
    std::setlocale(LC_ALL, before.c_str());
}

TEST(Text, NonFiniteAndOutOfRangeNumbersAreNumbers) {
    const ScanFolder folder;
    const std::vector<Vec3> points =
        read_all(folder.write("a.xyz", "nan -inf +INF\n1e999 -1e999 1e-999\n"));
    EXPECT_TRUE(std::isnan(points[0].x));
    EXPECT_EQ(points[0].y, -INFINITY);
    EXPECT_EQ(points[0].z, INFINITY);
    EXPECT_EQ(points[1], (Vec3{INFINITY, -INFINITY, 0}));
}

TEST(Text, AWrongLineIsNamedWithItsColumnAndText) {
    struct Case {
        std::string name;
        std::string content;
        std::string says;
    };
    const std::vector<Case> cases{
        {"a.xyz", "1 2 3\n4 five 6\n", "line 2: expected a number in column 2, found 'five'"},
        {"a.xyz", "1 2 3\n#\n4 5\n", "line 3: expected 3 columns, found 2"},
        {"a.xyz", "1 2 3\n4 5 6 7\n", "line 2: expected 3 columns, found 4"},
        {"a.xyz", "1 2\n3 4\n", "line 1: expected at least 3 columns, found 2"},
        {"a.csv", "1,2,3\n4,,6\n", "line 2: expected a number in column 2, found ''"},
        {"a.csv", "x,y,z\r\n1,2,3\r\n4,5,1.2.3\r\n",
         "line 3: expected a number in column 3, found '1.2.3'"},
        {"a.csv", "1,5;2,5;3,5\n", "line 1: expected a number in column 1, found '1,5'"},
        {"a.csv", "x,y,x\n1,2,3\n",
         "line 1: expected one column each named x, y and z, found 'x,y,x'"},
        {"a.csv", "east,north,up\n1,2,3\n",
         "line 1: expected columns named x, y and z, found 'east,north,up'"},
        {"a.csv", "x,y,z,i\n1,2\n", "line 2: expected at least 3 columns, found 2"},
        {"a.xyz", "1 2 oops\n", "line 1: expected a number in column 3, found 'oops'"},
        {"a.txt", "just words\n", "expected lines of numbers, found the end of the file"},
        {"a.txt", "# nothing\n\n", "expected lines of numbers, found only comments"},
        {"a.xyz", "-5\n1 2 3\n",
         "line 1: expected at least 3 columns of numbers, or a number of points, found '-5'"},
        {"a.pts", "version: 1\nn_points: 2\n{\n1 2\n3 4\n}\n", "landmark"},
        {"a.pts", "15\n1\n0 0 0\n", "PTX"},
        {"a.xyz", std::string("1 2 3\0", 6), "binary data"},
    };
    const ScanFolder folder;
    for (const Case& test : cases) {
        const std::string error = input_error_of(folder.write(test.name, test.content));
        EXPECT_THAT(error, HasSubstr(test.name + ": ")) << test.content;
        EXPECT_THAT(error, HasSubstr(test.says)) << test.content;
    }
}

TEST(Text, ALineWithoutEndIsNotHeldInMemory) {
    const ScanFolder folder;
    EXPECT_THAT(input_error_of(folder.write("a.xyz", "1 2 3\n" + std::string(3 << 20, '1'))),
                HasSubstr("line 2"));
}

TEST(Text, LinesLongerThanTheBufferAndAcrossItsEndAreWhole) {
    const ScanFolder folder;
    std::string text;
    std::vector<Vec3> expected;
    for (int i = 0; i < 40000; ++i) {
        text += std::to_string(i) + " 0.125 " + std::to_string(-i) + "\r\n";
        expected.push_back({static_cast<double>(i), 0.125, static_cast<double>(-i)});
    }
    text += "7" + std::string(600000, ' ') + "8 9\r\n";
    expected.push_back({7, 8, 9});
    EXPECT_EQ(read_all(folder.write("a.xyz", text)), expected);
}

TEST(Text, ReadsTheSharedFiles) {
    if (!std::filesystem::exists(shared_data("text"))) {
        GTEST_SKIP() << "no shared data";
    }
    EXPECT_EQ(read_all(shared_data("text/autzen.pts")).size(), 10U);
    EXPECT_EQ(read_all(shared_data("text/site_56_8.pts")).size(), 8U);
    EXPECT_EQ(read_all(shared_data("text/test.pts")).size(), 19U);
    EXPECT_EQ(read_all(shared_data("text/diamond.xyz")).size(), 6U);
    EXPECT_EQ(read_all(shared_data("text/file1.txt")), read_all(shared_data("text/quoted.txt")));
    EXPECT_EQ(read_all(shared_data("text/crlf_test.txt")),
              read_all(shared_data("text/utm17_1.txt")));
    EXPECT_EQ(read_all(shared_data("text/bunny_8.pts")).size(), 9U);  // its first line says 8
}

}  // namespace
}  // namespace knap
