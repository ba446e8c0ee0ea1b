// Pages of one console, as far as they concern it and its daemon: what the Map view asks, at its rhythm, over HTTP.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "proto/base/mutex.h"
#include "tests/support/process.h"
#include "tools/bench/heard.h"

namespace relmap::bench {

class ConsolePages {
 public:
  // Starts a relmap-console on the data folder of a daemon that runs, and returns when all pages follow the map and
  // have its picture. `folder`: for the console's layouts and log. Of `pages` the first `stalled` only open the stream
  // of events, and read nothing. Throws if a page is refused or does not get there.
  ConsolePages(const std::string& folder, const std::string& data, std::uint32_t pages, std::uint32_t stalled,
               Heard& heard);
  ~ConsolePages();  // ends the console, and with it all pages
  ConsolePages(const ConsolePages&) = delete;
  ConsolePages& operator=(const ConsolePages&) = delete;

  double console_cpu_seconds() const { return console_->cpu_seconds(); }
  std::size_t console_peak_bytes() const { return console_->peak_resident_bytes(); }
  std::uint64_t requests() const { return requests_; }  // beside the streams
  void throw_if_one_failed() const;

 private:
  struct Page;

  void start_console(const std::string& folder, const std::string& data);
  void open_pages(std::uint32_t pages, std::uint32_t stalled);
  void end();
  void in_thread(void (ConsolePages::*work)(Page&), Page& page);
  void log_in(Page& page);
  void follow_events(Page& page);
  void follow_layout(Page& page);
  void ask_regularly(Page& page);
  bool sleep(double seconds) const;  // false: it has to end

  Heard& heard_;
  std::unique_ptr<testing::Process> console_;
  std::uint16_t port_ = 0;
  std::string key_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> requests_{0};
  std::atomic<std::uint32_t> following_{0}, drawn_{0};  // pages
  mutable Mutex mutex_;
  std::string failure_ RELMAP_GUARDED_BY(mutex_);  // the first
  std::vector<std::unique_ptr<Page>> pages_;
  std::vector<std::thread> threads_;
};

}  // namespace relmap::bench
