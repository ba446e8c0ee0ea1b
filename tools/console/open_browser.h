// Opens the console in a browser of this desktop.
#pragma once

#include <memory>
#include <string>

#include "proto/base/status.h"

namespace relmap::console {

// A page on disk that leads a browser to an address with a key in it. What a program is started with can be seen by
// every user of the machine, and so xdg-open is started with the name of this page, which only this user can read.
class OpenedBrowser {
 public:
  // Writes the page to $XDG_RUNTIME_DIR, or to a folder of its own, and starts xdg-open. IO_ERROR: it cannot be
  // written.
  static Result<std::unique_ptr<OpenedBrowser>> open(const std::string& address);
  // Removes the page. A browser needs a few seconds to read it.
  ~OpenedBrowser();
  OpenedBrowser(const OpenedBrowser&) = delete;
  OpenedBrowser& operator=(const OpenedBrowser&) = delete;

 private:
  OpenedBrowser() = default;
  std::string folder_;  // empty: none was made
  std::string page_;
};

}  // namespace relmap::console
