#include "emit/output_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "emit/emit.hpp"
#include "emit/output_folder.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

namespace fs = std::filesystem;

class Output : public testing::Test {
  protected:
    OutputParams params(const std::string& name, bool overwrite = false) const {
        OutputParams output;
        output.path = (folder_ / name).string();
        output.overwrite = overwrite;
        return output;
    }

    void make_archive(const fs::path& folder) const {
        fs::create_directories(folder / "tiles");
        write_text_file(folder / "manifest.json", "{}");
        write_text_file(folder / "tiles" / "000000.drc", "DRACO");
    }

    test::TemporaryFolder scratch_;
    fs::path folder_ = scratch_.path();
};

TEST_F(Output, AnArchiveMayHoldAReport) {
    make_archive(folder_ / "archive");
    write_text_file(folder_ / "archive" / "report.html", "<html>");
    write_text_file(folder_ / "archive" / "report.html.partial", "<ht");
    EXPECT_TRUE(holds_only_archive(folder_ / "archive"));
    EXPECT_EQ(report_path((folder_ / "archive").string() + "/"),
              folder_ / "archive" / "report.html");
    EXPECT_EQ(report_path((folder_ / "out.ply").string()), folder_ / "out.ply.report.html");
}

TEST_F(Output, ThatDoesNotExistIsFineAndTheCheckLeavesNothing) {
    for (const char* name : {"archive", "archive/", "one.drc", "one.PLY"}) {
        EXPECT_NO_THROW(check_output(params(name))) << name;
    }
    EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Output, KindIsToldByTheEnding) {
    EXPECT_EQ(output_kind("a/b"), OutputKind::kArchive);
    EXPECT_EQ(output_kind("a/v1.2/"), OutputKind::kArchive);
    EXPECT_EQ(output_kind("b.drc"), OutputKind::kDraco);
    for (const char* name : {"b.Ply", "b.las", "b.LAZ", "b.xyz"}) {
        EXPECT_EQ(output_kind(name), OutputKind::kCloud) << name;
    }
    EXPECT_THAT([] { output_kind("b.pcd"); },
                ThrowsMessage<ConfigError>(AllOf(HasSubstr("output.path"), HasSubstr("b.pcd"))));
}

TEST_F(Output, ThatExistsNeedsOverwrite) {
    make_archive(folder_ / "archive");
    write_text_file(folder_ / "one.ply", "ply");
    for (const char* name : {"archive", "archive/", "one.ply"}) {
        EXPECT_THAT([&] { check_output(params(name)); },
                    ThrowsMessage<ConfigError>(HasSubstr("exists (needs --overwrite)")))
            << name;
        EXPECT_NO_THROW(check_output(params(name, true))) << name;
    }
}

TEST_F(Output, AFolderThatIsNoArchiveIsNeverOverwritten) {
    for (const char* stray : {"notes.txt", "tiles/photo.jpg", "sub/000000.drc"}) {
        const fs::path folder = folder_ / "mine";
        make_archive(folder);
        fs::create_directories((folder / stray).parent_path());
        write_text_file(folder / stray, "precious");
        EXPECT_THAT([&] { check_output(params("mine", true)); },
                    ThrowsMessage<ConfigError>(HasSubstr("left alone")))
            << stray;
        {
            OutputFolder output(folder);
            EXPECT_THROW(output.commit(true), StorageError);
        }
        EXPECT_EQ(read_text_file(folder / stray), "precious");
        EXPECT_FALSE(fs::exists(folder_ / "mine.partial"));
        fs::remove_all(folder);
    }
}

TEST_F(Output, AFolderInTheWayOfTheTemporaryOneIsLeftAlone) {
    fs::create_directory(folder_ / "archive.partial");
    write_text_file(folder_ / "archive.partial" / "thesis.doc", "precious");
    EXPECT_THAT([&] { check_output(params("archive")); },
                ThrowsMessage<ConfigError>(HasSubstr("archive.partial")));
    EXPECT_THROW(OutputFolder{folder_ / "archive"}, StorageError);
    EXPECT_EQ(read_text_file(folder_ / "archive.partial" / "thesis.doc"), "precious");
}

TEST_F(Output, InAFolderThatDoesNotExistIsRefused) {
    for (const char* name : {"none/archive", "none/one.ply"}) {
        EXPECT_THAT([&] { check_output(params(name)); },
                    ThrowsMessage<ConfigError>(AllOf(HasSubstr("output.path"), HasSubstr("none"))))
            << name;
    }
    write_text_file(folder_ / "file", "");
    EXPECT_THROW(check_output(params("file/archive")), ConfigError);
    OutputParams unwritable;
    unwritable.path = "/proc/knap-output";
    EXPECT_THROW(check_output(unwritable), ConfigError);
}

TEST_F(Output, ThatIsAnInputIsRefused) {
    write_text_file(folder_ / "one.ply", "ply");
    const std::vector<fs::path> inputs{folder_ / "." / "one.ply"};
    EXPECT_THAT([&] { check_output(params("one.ply", true), inputs); },
                ThrowsMessage<ConfigError>(HasSubstr("no input")));
    OutputParams ids = params("archive", true);
    ids.ids = (folder_ / "one.ply").string();
    EXPECT_THAT([&] { check_output(ids, inputs); }, ThrowsMessage<ConfigError>(HasSubstr("--ids")));
}

TEST_F(Output, TheFileOfIdsIsCheckedLikewise) {
    OutputParams output = params("one.ply");
    output.ids = (folder_ / "ids.txt").string();
    EXPECT_NO_THROW(check_output(output));
    write_text_file(output.ids, "1\n");
    EXPECT_THAT([&] { check_output(output); },
                ThrowsMessage<ConfigError>(AllOf(HasSubstr("output.ids"), HasSubstr("exists"))));
    output.overwrite = true;
    EXPECT_NO_THROW(check_output(output));
    output.ids = output.path;
    EXPECT_THROW(check_output(output), ConfigError);
}

TEST_F(Output, IdsAreWrittenOneALineAscending) {
    Selection selection(200);
    for (const PointId id : {199U, 0U, 64U, 7U}) {
        selection.set(id);
    }
    selection.finish();
    write_ids(folder_ / "ids.txt", selection)->commit();
    EXPECT_EQ(read_text_file(folder_ / "ids.txt"), "0\n7\n64\n199\n");
    write_ids(folder_ / "none.txt", Selection(100))->commit();
    EXPECT_EQ(read_text_file(folder_ / "none.txt"), "");
}

TEST(EmitRequest, ResultParametersAreThoseThatShapeTheResult) {
    Job job;
    job.range.alpha = 0.4;
    std::set<std::string> keys;
    for (const auto& [key, value] : result_parameters(job)) {
        keys.insert(key);
    }
    EXPECT_TRUE(keys.contains("range.alpha"));
    EXPECT_FALSE(keys.contains("resources.threads"));
    EXPECT_FALSE(keys.contains("output.path"));
}

TEST_F(Output, AFolderAppearsWholeOrNotAtAll) {
    const fs::path target = folder_ / "archive";
    {
        const OutputFolder output(target);
        make_archive(output.path());
    }
    EXPECT_TRUE(fs::is_empty(folder_));
    {
        OutputFolder output(target);
        make_archive(output.path());
        output.commit(false);
    }
    EXPECT_TRUE(fs::exists(target / "manifest.json"));
    {
        OutputFolder output(target);
        EXPECT_THROW(output.commit(false), StorageError);
        EXPECT_TRUE(fs::exists(target / "tiles" / "000000.drc"));
        output.commit(true);
    }
    EXPECT_FALSE(fs::exists(target / "manifest.json"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

}  // namespace
}  // namespace knap
