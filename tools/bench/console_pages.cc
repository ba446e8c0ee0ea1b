#include "tools/bench/console_pages.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string_view>

#include "proto/base/clock.h"
#include "proto/base/ids.h"
#include "proto/base/json.h"
#include "relmap/v1/map.pb.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/stopwatch.h"
#include "tools/console/forward/grpc_web.h"
#include "tools/console/http/testing/raw_browser.h"

namespace relmap::bench {

namespace {

using console::testing::Answer;
using console::testing::RawBrowser;
using std::chrono::milliseconds;

// The rhythm of the page: page/src/lib/caller.svelte.ts, page/src/views/map.
constexpr double kStatusEvery_s = 2, kPlacesEvery_s = 0.5, kLayoutAtMostEvery_s = 0.25;
constexpr std::uint32_t kZoom = 1;  // a map that fills a screen is drawn of its four tiles
constexpr char kMap[] = "/relmap.v1.Map/";

std::string printed_address(testing::Process& console, const std::string& out, const std::string& log) {
  const auto begin = Clock::now();
  for (;;) {
    std::string text = testing::read_text(out);
    if (const std::size_t end = text.find('\n'); end != std::string::npos) return text.substr(0, end);
    if (!console.running() || seconds_since(begin) > 120)
      throw std::runtime_error("relmap-console does not serve: " + testing::read_text(log));
    std::this_thread::sleep_for(milliseconds(5));
  }
}

// The message of a unary answer.
std::string message_of(const Answer& answer, const std::string& method) {
  const auto refused = [&](const std::string& why) { return std::runtime_error(method + ": " + why); };
  if (answer.status != 200) throw refused("HTTP status " + std::to_string(answer.status) + " " + answer.body);
  std::string message;
  const auto frames = console::frames_of(answer.body).or_throw();
  if (frames.empty() || !frames.back().trailers) throw refused("it has no end");
  const auto end = console::read_trailers(frames.back().bytes).or_throw();
  if (end.code != 0) throw refused(end.message);
  for (const console::Frame& frame : frames)
    if (!frame.trailers) message += frame.bytes;
  return message;
}

std::uint64_t version_in(const std::string& layout) {
  constexpr std::string_view kName = "\"version\":";
  std::uint64_t version = 0;
  if (const std::size_t at = layout.find(kName); at != std::string::npos)
    std::from_chars(layout.data() + at + kName.size(), layout.data() + layout.size(), version);
  return version;
}

}  // namespace

// A page has three connections at a time: the stream of events, the question for the next layout, and the rest.
struct ConsolePages::Page {
  std::uint32_t number = 0;
  std::string port, cookie;
  std::unique_ptr<RawBrowser> unread;  // of a stalled page

  Mutex mutex;
  // Frames that were added since the page was opened, and those of them whose places are to be asked.
  std::vector<std::string> frames RELMAP_GUARDED_BY(mutex), wanted RELMAP_GUARDED_BY(mutex);

  std::string head(const char* method, const std::string& path) const {
    return std::string(method) + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + port +
           "\r\nOrigin: http://127.0.0.1:" + port + "\r\nCookie: " + cookie + "\r\n";
  }
  std::string get(const std::string& path) const { return head("GET", path) + "\r\n"; }
  std::string post(const std::string& path, const std::string& type, const std::string& body) const {
    return head("POST", path) + "Content-Type: " + type + "\r\nContent-Length: " + std::to_string(body.size()) +
           "\r\n\r\n" + body;
  }
  std::string call(const std::string& method, const google::protobuf::Message& request) const {
    return post(kMap + method, "application/grpc-web+proto", console::message_frame(request.SerializeAsString()));
  }
  std::string watch() const {
    v1::WatchMapRequest request;
    request.set_from(v1::WATCH_FROM_NOW);
    return call("WatchMap", request);
  }
};

ConsolePages::ConsolePages(const std::string& folder, const std::string& data, std::uint32_t pages,
                           std::uint32_t stalled, Heard& heard)
    : heard_(heard) {
  try {
    start_console(folder, data);
    open_pages(pages, stalled);
  } catch (...) {
    end();
    throw;
  }
}

ConsolePages::~ConsolePages() { end(); }

void ConsolePages::end() {
  stop_ = true;
  console_.reset();  // closes all connections
  for (std::thread& thread : threads_) thread.join();
}

void ConsolePages::start_console(const std::string& folder, const std::string& data) {
  const std::string out = folder + "/console.out", log = folder + "/console.log";
  std::filesystem::remove(out);
  console_ = std::make_unique<testing::Process>(
      std::vector<std::string>{testing::built_program("relmap-console"), data, "--listen", "127.0.0.1:0", "--cache",
                               folder + "/cache"},
      testing::ProcessOptions{.standard_output = out, .standard_error = log});
  const std::string address = printed_address(*console_, out, log);
  constexpr std::string_view kHost = "http://127.0.0.1:", kKey = "/#key=";
  const std::size_t key = address.find(kKey);
  if (!address.starts_with(kHost) || key == std::string::npos)
    throw std::runtime_error("'" + address + "' is no address of a console with a key");
  std::from_chars(address.data() + kHost.size(), address.data() + key, port_);
  key_ = address.substr(key + kKey.size());
}

void ConsolePages::open_pages(std::uint32_t pages, std::uint32_t stalled) {
  for (std::uint32_t number = 0; number < pages; ++number) {
    pages_.push_back(std::make_unique<Page>());
    Page& page = *pages_.back();
    page.number = number;
    page.port = std::to_string(port_);
    log_in(page);
    if (number < stalled) {
      page.unread = std::make_unique<RawBrowser>(port_);
      page.unread->send(page.watch());
      continue;
    }
    in_thread(&ConsolePages::follow_events, page);
    in_thread(&ConsolePages::follow_layout, page);
    in_thread(&ConsolePages::ask_regularly, page);
  }
  const auto begin = Clock::now();
  while (following_ < pages - stalled || drawn_ < pages - stalled) {
    throw_if_one_failed();
    if (seconds_since(begin) > 120) throw std::runtime_error("pages do not get the picture of the map");
    std::this_thread::sleep_for(milliseconds(10));
  }
}

void ConsolePages::throw_if_one_failed() const {
  const MutexLock lock(mutex_);
  if (!failure_.empty()) throw std::runtime_error("a page failed: " + failure_);
}

void ConsolePages::in_thread(void (ConsolePages::*work)(Page&), Page& page) {
  threads_.emplace_back([this, work, &page] {
    std::string failure = "its connection was closed";
    try {
      (this->*work)(page);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    if (stop_) return;
    const MutexLock lock(mutex_);
    if (failure_.empty()) failure_ = failure;
  });
}

bool ConsolePages::sleep(double seconds) const {
  for (const auto begin = Clock::now(); !stop_ && seconds_since(begin) < seconds;)
    std::this_thread::sleep_for(milliseconds(20));
  return !stop_;
}

void ConsolePages::log_in(Page& page) {
  RawBrowser browser(port_);
  Answer answer = browser.send(page.post("/login", "application/json", Json().add("token", key_).text())).answer();
  if (answer.status != 204) throw std::runtime_error("a page cannot log in: " + answer.body);
  const std::string& cookie = answer.headers["set-cookie"];
  page.cookie = cookie.substr(0, cookie.find(';'));
}

void ConsolePages::follow_events(Page& page) {
  RawBrowser browser(port_);
  if (const Answer head = browser.send(page.watch()).head(); head.status != 200)
    throw std::runtime_error("WatchMap: HTTP status " + std::to_string(head.status));
  HeardByOne heard(heard_);
  std::string held;
  v1::MapEvent event;
  while (const auto chunk = browser.chunk()) {
    held += *chunk;
    const auto frames = console::frames_of(held);
    if (frames.reason() == Reason::TRUNCATED) continue;
    throw_if(frames.status());
    for (const console::Frame& frame : *frames) {
      if (frame.trailers) throw std::runtime_error("WatchMap ended: " + std::string(frame.bytes));
      event.ParseFromArray(frame.bytes.data(), static_cast<int>(frame.bytes.size()));
      if (event.has_caught_up()) {
        if (!heard.has_caught_up()) ++following_;
        heard.caught_up(event.caught_up().journal_sequence(), event.caught_up().time_us(), now_us());
        continue;
      }
      heard.event();
      const MutexLock lock(page.mutex);
      for (const v1::AddedFrame& added : event.frames_added().frames()) {
        page.frames.push_back(FrameId{added.frame().session(), added.frame().index()}.to_string());
        page.wanted.push_back(page.frames.back());
      }
    }
    held.clear();
  }
}

void ConsolePages::follow_layout(Page& page) {
  RawBrowser waits(port_), fetches(port_);
  std::uint64_t drawn = 0;
  do {
    const Answer answer = waits.send(page.get("/map/layout?after=" + std::to_string(drawn) + "&wait=25")).answer();
    if (answer.status != 200) throw std::runtime_error("/map/layout: HTTP status " + std::to_string(answer.status));
    ++requests_;
    const std::uint64_t version = version_in(answer.body);
    if (version == drawn) continue;
    for (std::uint32_t tile = 0; tile < 4; ++tile) {
      const std::string path = "/map/tiles/" + std::to_string(version) + "/" + std::to_string(kZoom) + "/" +
                               std::to_string(tile % 2) + "/" + std::to_string(tile / 2);
      const std::string from = drawn == 0 ? "" : "?from=" + std::to_string(drawn);
      const Answer got = fetches.send(page.get(path + from)).answer();
      ++requests_;
      // 404: a newer layout has come, which is drawn next.
      if (got.status != 200 && got.status != 204 && got.status != 404)
        throw std::runtime_error(path + ": HTTP status " + std::to_string(got.status) + " " + got.body);
    }
    if (drawn == 0) ++drawn_;
    drawn = version;
    const MutexLock lock(page.mutex);
    page.wanted = page.frames;  // another layout has other places
  } while (sleep(kLayoutAtMostEvery_s));
}

void ConsolePages::ask_regularly(Page& page) {
  RawBrowser browser(port_);
  const auto call = [&](const std::string& method, const google::protobuf::Message& request) {
    message_of(browser.send(page.call(method, request)).answer(), method);
    ++requests_;
  };
  call("ListSessions", v1::ListSessionsRequest());
  call("FindLabels", v1::FindLabelsRequest());
  // Pages were opened at any time.
  if (!sleep(kStatusEvery_s * (page.number % 50) / 50)) return;
  constexpr int kSteps = static_cast<int>(kStatusEvery_s / kPlacesEvery_s);
  for (int step = 0;; step = (step + 1) % kSteps) {
    if (step == 0) {
      call("GetStatus", v1::GetStatusRequest());
      call("ListRobots", v1::ListRobotsRequest());
    }
    std::vector<std::string> wanted;
    {
      const MutexLock lock(page.mutex);
      wanted.swap(page.wanted);
    }
    if (!wanted.empty()) {
      const Answer answer =
          browser.send(page.post("/map/places", "application/json", Json().add("frames", wanted).text())).answer();
      ++requests_;
      if (answer.status != 200) throw std::runtime_error("/map/places: HTTP status " + std::to_string(answer.status));
    }
    if (!sleep(kPlacesEvery_s)) return;
  }
}

}  // namespace relmap::bench
