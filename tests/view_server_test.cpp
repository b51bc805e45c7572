#include "view/view_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "base/file.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "support/emit_fixture.hpp"
#include "view/site.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;
using namespace test;

namespace fs = std::filesystem;

/// What a server on 127.0.0.1 answers to these very bytes, until it closes.
std::string answer_to(int port, const std::string& request) {
    const int connection = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::string text;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): as the system's interface has it
    if (connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
        write(connection, request.data(), request.size()) == static_cast<ssize_t>(request.size())) {
        std::vector<char> buffer(1 << 16);
        for (ssize_t got = 1; got > 0;) {
            got = read(connection, buffer.data(), buffer.size());
            text.append(buffer.data(), got > 0 ? static_cast<std::size_t>(got) : 0);
        }
    }
    close(connection);
    return text;
}

class ViewServerTest : public EmitFixture {
  protected:
    void SetUp() override {
        EmitFixture::SetUp();
        page_ = folder_ / "page";
        fs::create_directories(page_ / "vendor");
        write_text_file(page_ / "index.html", "<p>the page</p>");
        write_text_file(page_ / "main.mjs", "the program");
        write_text_file(page_ / "vendor" / "decoder.wasm", "wasm");
        archive_ = make_archive();
        write_text_file(archive_ / "secret.txt", "a secret");
        write_text_file(folder_ / "secret.txt", "a secret");
    }

    Site site() const {
        Site site;
        add_page(site, page_);
        add_archive(site, "/archive/", Archive(archive_));
        return site;
    }

    /// Serves while `act` asks.
    template <typename Act>
    void serve(const Act& act) {
        ViewServer server(site(), 0);
        std::atomic<bool> done = false;
        std::thread serving([&] { server.serve_until([&] { return done.load(); }); });
        act(server.port());
        done = true;
        serving.join();
    }

    static std::string get(int port, const std::string& address, const std::string& host) {
        return answer_to(port, "GET " + address + " HTTP/1.1\r\nHost: " + host +
                                   "\r\nConnection: close\r\n\r\n");
    }
    static std::string get(int port, const std::string& address) {
        return get(port, address, "127.0.0.1:" + std::to_string(port));
    }

    fs::path page_;
    fs::path archive_;
};

TEST_F(ViewServerTest, HandsOutThePageAndTheArchiveWithTheirTypes) {
    serve([&](int port) {
        for (const char* address : {"/", "/index.html", "/?before=before/"}) {
            EXPECT_THAT(get(port, address),
                        AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Type: text/html"),
                              EndsWith("<p>the page</p>")));
        }
        EXPECT_THAT(get(port, "/main.mjs"),
                    AllOf(HasSubstr("Content-Type: text/javascript"), EndsWith("the program")));
        EXPECT_THAT(get(port, "/vendor/decoder.wasm"),
                    HasSubstr("Content-Type: application/wasm\r\n"));
        EXPECT_THAT(get(port, "/archive/manifest.json"),
                    AllOf(HasSubstr("Content-Type: application/json\r\n"),
                          EndsWith("\r\n\r\n" + read_text_file(archive_ / "manifest.json"))));
        const Archive archive(archive_);
        for (const ManifestTile& tile : archive.manifest().tiles) {
            EXPECT_THAT(get(port, "/archive/" + tile.file),
                        AllOf(HasSubstr("Content-Type: application/octet-stream\r\n"),
                              EndsWith("\r\n\r\n" + read_text_file(archive_ / tile.file))));
        }
    });
}

TEST_F(ViewServerTest, HandsOutNothingElseHoweverItIsAskedFor) {
    serve([&](int port) {
        for (const char* address :
             {"/archive/secret.txt", "/archive/../secret.txt", "/archive/%2e%2e/secret.txt",
              "/archive/..%2fsecret.txt", "/archive/tiles/../secret.txt",
              "/archive//../../secret.txt", "//etc/passwd", "/../../../../../etc/passwd",
              "/vendor/%2e%2e/%2e%2e/secret.txt", "/vendor/", "/archive/", "/archive",
              "/archive/tiles/", "/main.mjs%00.html", "/ARCHIVE/manifest.json"}) {
            EXPECT_THAT(get(port, address),
                        AllOf(StartsWith("HTTP/1.1 404"), Not(HasSubstr("secret\n"))))
                << address;
        }
        EXPECT_THAT(answer_to(port, "POST / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                                        "\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
                    StartsWith("HTTP/1.1 404"));
    });
}

TEST_F(ViewServerTest, AnswersOnlyUnderTheNamesOfThisMachine) {
    serve([&](int port) {
        const std::string number = std::to_string(port);
        EXPECT_THAT(get(port, "/", "localhost:" + number), StartsWith("HTTP/1.1 200"));
        for (const std::string& host :
             {"evil.example:" + number, std::string("evil.example"), std::string("127.0.0.1"),
              "127.0.0.1:" + number + ".evil.example", std::string()}) {
            EXPECT_THAT(get(port, "/archive/manifest.json", host),
                        AllOf(StartsWith("HTTP/1.1 403"), Not(HasSubstr("knap archive"))))
                << host;
        }
    });
}

TEST_F(ViewServerTest, AFileThatIsGoneIsNotFoundAndTheServerGoesOn) {
    serve([&](int port) {
        const std::string tile = Archive(archive_).manifest().tiles[0].file;
        fs::remove(archive_ / tile);
        EXPECT_THAT(get(port, "/archive/" + tile), StartsWith("HTTP/1.1 404"));
        EXPECT_THAT(get(port, "/"), StartsWith("HTTP/1.1 200"));
    });
}

TEST_F(ViewServerTest, APortThatIsTakenIsAnErrorNamingIt) {
    const ViewServer first(site(), 0);
    EXPECT_THAT([&] { ViewServer(site(), first.port()); },
                ThrowsMessage<StorageError>(HasSubstr(std::to_string(first.port()))));
}

TEST_F(ViewServerTest, ThePageIsFoundBesideTheProgramOrWhereItIsInstalled) {
    const fs::path root = folder_ / "root";
    EXPECT_THAT([&] { find_page(root / "bin" / "knap"); },
                ThrowsMessage<StorageError>(AllOf(HasSubstr((root / "bin" / "viewer").string()),
                                                  HasSubstr("share/knap/viewer"))));
    const fs::path installed = root / "share" / "knap" / "viewer";
    fs::create_directories(installed);
    write_text_file(installed / "index.html", "");
    EXPECT_EQ(find_page(root / "bin" / "knap"), installed);
    const fs::path built = root / "bin" / "viewer";
    fs::create_directories(built);
    write_text_file(built / "index.html", "");
    EXPECT_EQ(find_page(root / "bin" / "knap"), built);
}

}  // namespace
}  // namespace knap
