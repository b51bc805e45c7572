#include "view/view_server.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr const char* kHost = "127.0.0.1";
constexpr int kNotFound = 404;
constexpr int kForbidden = 403;
constexpr auto kPause = std::chrono::milliseconds(50);  // between two questions whether to stop

// The page may use what comes from this server, and nothing else. Draco's decoder is WebAssembly in
// a worker that three.js makes from text.
constexpr const char* kPolicy =
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:; "
    "worker-src 'self' blob:; style-src 'self'; img-src 'self' data: blob:; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Unlike the library's own options, two servers on one port are refused.
void set_socket_options(int socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

void answer(const Site& site, const httplib::Request& request, httplib::Response& response) {
    const auto found = site.find(request.path);
    if (found == site.end()) {
        response.status = kNotFound;
        response.set_content("not found\n", "text/plain");
        return;
    }
    try {
        response.set_content(read_text_file(found->second.path), found->second.type);
    } catch (const Error& error) {
        response.status = kNotFound;
        response.set_content(std::string(error.what()) + "\n", "text/plain");
    }
}

}  // namespace

class ViewServer::Implementation {
  public:
    Implementation(Site site, int port) : site_(std::move(site)) {
        server_.set_socket_options(set_socket_options);
        server_.set_keep_alive_timeout(1);
        server_.set_tcp_nodelay(true);
        server_.set_default_headers({{"Content-Security-Policy", kPolicy},
                                     {"Cross-Origin-Resource-Policy", "same-origin"},
                                     {"X-Content-Type-Options", "nosniff"},
                                     {"Cache-Control", "no-cache"}});
        port_ = port == 0                           ? server_.bind_to_any_port(kHost)
                : server_.bind_to_port(kHost, port) ? port
                                                    : -1;
        if (port_ < 0) {
            throw StorageError(
                fmt::format("{}:{}: cannot listen: the port is taken, or not allowed; --port 0 "
                            "takes a free one",
                            kHost, port));
        }
        server_.set_pre_routing_handler(
            [this](const httplib::Request& request, httplib::Response& response) {
                if (is_for_us(request.get_header_value("Host"))) {
                    return httplib::Server::HandlerResponse::Unhandled;
                }
                response.status = kForbidden;
                response.set_content("this server answers to 127.0.0.1 and localhost only\n",
                                     "text/plain");
                return httplib::Server::HandlerResponse::Handled;
            });
        server_.Get(".*", [this](const httplib::Request& request, httplib::Response& response) {
            answer(site_, request, response);
        });
    }

    int port() const { return port_; }

    void serve_until(const std::function<bool()>& stop) {
        std::atomic<bool> ended = false;
        std::thread listener([&] {
            server_.listen_after_bind();
            ended = true;
        });
        while (!ended && !stop()) {
            std::this_thread::sleep_for(kPause);
        }
        const bool failed = ended;
        server_.stop();
        listener.join();
        if (failed) {
            throw StorageError(fmt::format("{}:{}: the system ended the listening", kHost, port_));
        }
    }

  private:
    bool is_for_us(const std::string& host) const {
        return host == fmt::format("{}:{}", kHost, port_) ||
               host == fmt::format("localhost:{}", port_);
    }

    Site site_;
    httplib::Server server_;
    int port_ = -1;
};

ViewServer::ViewServer(Site site, int port)
    : implementation_(std::make_unique<Implementation>(std::move(site), port)) {}

ViewServer::~ViewServer() = default;

int ViewServer::port() const {
    return implementation_->port();
}

void ViewServer::serve_until(const std::function<bool()>& stop) {
    implementation_->serve_until(stop);
}

}  // namespace knap
