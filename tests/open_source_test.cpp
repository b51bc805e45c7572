#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::input_error_of;
using test::LasFile;
using test::read_all;
using test::ScanFolder;
using testing::ElementsAre;
using testing::HasSubstr;

namespace fs = std::filesystem;

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "end_header\n1 2 3\n";

std::string error_of(const std::vector<std::string>& patterns) {
    try {
        expand_sources(patterns);
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

TEST(OpenSource, ContentGoesBeforeEnding) {
    const ScanFolder folder;
    const LasFile las{.points = {{1, 2, 3}}};
    EXPECT_EQ(open_source(folder.write("a.xyz", kPly))->info().format, "PLY (ASCII)");
    EXPECT_EQ(open_source(folder.write("a.ply", las.bytes()))->info().format,
              "LAS 1.2, point format 0");
    EXPECT_EQ(open_source(folder.write("noending", las.bytes()))->info().format,
              "LAS 1.2, point format 0");
    EXPECT_EQ(open_source(folder.write("a.txt",
                                       "# .PCD v.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
                                       "WIDTH 0\nHEIGHT 1\nDATA ascii\n"))
                  ->info()
                  .format,
              "PCD (ASCII)");
    EXPECT_EQ(open_source(folder.write("a.dat", "1 2 3\n"))->info().format,
              "text (blank-separated)");
    EXPECT_EQ(open_source(folder.write("A.CSV", "x,y,z\n"))->info().format,
              "text (comma-separated)");
}

TEST(OpenSource, WhatIsNoPointCloudIsRefusedByName) {
    const ScanFolder folder;
    const std::vector<std::array<std::string, 3>> cases{
        {"a.ply.gz", "\x1f\x8b\x08 compressed", "a damaged gzip file"},
        {"a.ply", "\x1f\x8b\x08 compressed", "a damaged gzip file"},
        {"a.pcd", "# .PCD v.7\n", "line 2: expected a PCD header"},
        {"a.pcd", "VERSION .7\n", "line 2: expected a PCD header"},
        {"a.drc", "DRACO\x02\x02", "expected a Draco point cloud"},
        {"manifest.json", "{\"format\": \"knap archive\"", "no JSON"},
        {"a.e57", "ASTM-E57", "E57"},
        {"a.laz", "version https://git-lfs.github.com/spec/v1\n", "Git LFS"},
        {"a.zip", "PK\x03\x04", "zip"},
        {"a.ply", "PLY\n", "'ply'"},
        {"a.laz", "LAZ!", "'LASF'"},
        {"a.bin", std::string("\0\1\2", 3), "unknown format"},
        {"a.md", "# title\nwords\n", "'# title'"},
        {"a.off", "OFF\n8 6 0\n0 0 0\n", "'OFF'"},
        {"a.ply", "", "empty"},
        {"a.xyz", "", "empty"},
    };
    for (const auto& [name, content, says] : cases) {
        const std::string error = input_error_of(folder.write(name, content));
        EXPECT_THAT(error, HasSubstr(name + ": ")) << name;
        EXPECT_THAT(error, HasSubstr("expected")) << name;
        EXPECT_THAT(error, HasSubstr(says)) << name;
    }
}

TEST(OpenSource, MissingFoldersAndUnreadableFilesAreErrors) {
    const ScanFolder folder;
    EXPECT_THAT(input_error_of(folder.path() / "none.ply"), HasSubstr("none.ply"));
    EXPECT_THAT(input_error_of(folder.path()), HasSubstr("regular file"));
    const auto locked = folder.write("locked.ply", kPly);
    fs::permissions(locked, fs::perms::none);
    if (::access(locked.c_str(), R_OK) == 0) {
        GTEST_SKIP() << "this user may read everything";
    }
    EXPECT_THAT(input_error_of(locked), HasSubstr("locked.ply"));
}

TEST(ExpandSources, AFolderGivesItsPointCloudsSortedByPath) {
    const ScanFolder folder;
    const auto c = folder.write("b/c.ply", kPly);
    const auto a = folder.write("b/a/z.xyz", "1 2 3\n");
    const auto b = folder.write("a.csv", "x,y,z\n1,2,3\n");
    const auto bad = folder.write("b/d.laz", "no LAZ at all");
    folder.write("notes.txt", "words and words\n");
    folder.write("b/.hidden.ply", kPly);
    folder.write(".cache/a.ply", kPly);
    folder.write("out.partial/tiles/000000.drc", "DRACO");
    const auto drc = folder.write("b/tiles/1.drc", "DRACO");
    EXPECT_THAT(expand_sources({folder.path().string()}), ElementsAre(b, a, c, bad, drc));
}

TEST(ExpandSources, EntriesKeepTheirOrderAndGlobsAreSorted) {
    const ScanFolder folder;
    const auto a = folder.write("a.ply", kPly);
    const auto b = folder.write("b.ply", kPly);
    const auto c = folder.write("c/c.ply", kPly);
    const std::string root = folder.path().string();
    EXPECT_THAT(expand_sources({c.string(), root + "/*.ply"}), ElementsAre(c, a, b));
    EXPECT_THAT(expand_sources({root + "/[bc]*"}), ElementsAre(b, c));
    // A name that exists is no pattern.
    const auto odd = folder.write("[ab].ply", kPly);
    EXPECT_THAT(expand_sources({odd.string()}), ElementsAre(odd));
}

TEST(ExpandSources, NothingToReadIsAnErrorThatNamesTheEntry) {
    const ScanFolder folder;
    folder.write("empty/notes.txt", "words\n");
    const std::string root = folder.path().string();
    EXPECT_THAT(error_of({root + "/*.laz"}), HasSubstr("*.laz"));
    EXPECT_THAT(error_of({root + "/none.ply"}), HasSubstr("none.ply"));
    EXPECT_THAT(error_of({root + "/empty"}), HasSubstr("found none"));
}

TEST(ExpandSources, TheSameFileTwiceIsAnErrorWhateverItsName) {
    const ScanFolder folder;
    const auto a = folder.write("a.ply", kPly);
    const std::string root = folder.path().string();
    EXPECT_THAT(
        error_of({a.string(), root + "/../" + folder.path().filename().string() + "/a.ply"}),
        HasSubstr("twice"));
    fs::create_symlink(a, folder.path() / "b.ply");
    EXPECT_THAT(error_of({root}), HasSubstr("b.ply"));
}

TEST(ScalarType, HasAName) {
    EXPECT_STREQ(to_string(ScalarType::kInt8), "int8");
    EXPECT_STREQ(to_string(ScalarType::kUint64), "uint64");
    EXPECT_STREQ(to_string(ScalarType::kFloat32), "float32");
    EXPECT_STREQ(to_string(ScalarType::kFloat64), "float64");
}

}  // namespace
}  // namespace knap
