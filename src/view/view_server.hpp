#pragma once

#include <functional>
#include <memory>

#include "view/site.hpp"

namespace knap {

/// Hands out the files of a site by HTTP, to programs of this machine only: it listens on
/// 127.0.0.1, and answers requests that name it so, so that no page from elsewhere reads an archive
/// under another name of this address.
class ViewServer {
  public:
    /// Listens; requests wait until serve_until().
    /// @param port  1 .. 65535, or 0 for any that is free
    /// @throws StorageError if the port is taken
    ViewServer(Site site, int port);
    ~ViewServer();
    ViewServer(const ViewServer&) = delete;
    ViewServer& operator=(const ViewServer&) = delete;

    /// The port that it listens on.
    int port() const;

    /// Answers requests; returns soon after `stop` has returned true. To be called once.
    /// @param stop  asked some times a second
    /// @throws StorageError if the system ends the listening
    void serve_until(const std::function<bool()>& stop);

  private:
    class Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace knap
