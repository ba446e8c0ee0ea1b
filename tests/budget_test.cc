// A map several times larger than relmapd's memory budget is taken in while clients send pictures. The daemon stays
// within the budget, and answers as with plenty of memory.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <thread>

#include "proto/base/crc32c.h"
#include "proto/wire/convert.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/map_stub.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

constexpr std::size_t kMegabyte = std::size_t{1} << 20;
constexpr std::size_t kPlentyMb = 4096;

// The replies to a fixed set of questions about a map of one session, without what depends on the run.
class Questions {
 public:
  Questions(const std::string& address, const std::vector<Keyframe>& keyframes)
      : map_(address), keyframes_(keyframes) {}

  std::vector<std::string> ask(int samples) {
    std::mt19937 random(7);
    const auto any_frame = [&] {
      return FrameId{1, std::uniform_int_distribution<std::uint32_t>(
                            0, static_cast<std::uint32_t>(keyframes_.size() - 1))(random)};
    };
    edges();
    for (const Keyframe& keyframe : keyframes_) frame({1, keyframe.sequence});  // through all that is on disk
    for (int i = 0; i < samples; ++i) {
      const FrameId a = any_frame(), b = any_frame();
      neighbourhood(a);
      transform(a, b);
      route(a, b);
      place(keyframes_[a.index]);
    }
    return std::move(answers_);
  }

 private:
  template <typename Reply>
  void remember(const std::string& what, const Reply& reply) {
    const std::string bytes = reply.SerializeAsString();
    answers_.push_back(what + ": " + std::to_string(bytes.size()) + " bytes, " +
                       std::to_string(crc32c(as_bytes(bytes))));
  }
  template <typename Reply>
  void note(const std::string& what, Result<Reply> reply) {
    ASSERT_TRUE(reply.ok()) << what << ": " << reply.status().to_string();
    reply->clear_map_version();
    remember(what, *reply);
  }

  void edges() {
    v1::ListEdgesRequest request;
    request.set_page_size(5000);
    do {
      auto reply = map_.ask(&v1::Map::Stub::ListEdges, request);
      ASSERT_TRUE(reply.ok()) << reply.status().to_string();
      request.set_page_token(reply->next_page_token());
      reply->clear_next_page_token();
      note("edges", std::move(reply));
    } while (!request.page_token().empty());
  }
  void frame(FrameId id) {
    v1::GetFrameRequest request;
    *request.mutable_frame() = to_wire(id);
    request.set_landmarks(true);
    request.set_observations(true);
    request.set_appearance(true);
    note("frame " + id.to_string(), map_.ask(&v1::Map::Stub::GetFrame, request));
  }
  void neighbourhood(FrameId id) {
    v1::GetNeighbourhoodRequest request;
    *request.mutable_root() = to_wire(id);
    request.set_landmarks(true);
    note("neighbourhood of " + id.to_string(), map_.ask(&v1::Map::Stub::GetNeighbourhood, request));
  }
  void transform(FrameId a, FrameId b) {
    v1::TransformBetweenRequest request;
    *request.mutable_a() = to_wire(a);
    *request.mutable_b() = to_wire(b);
    note("transform " + a.to_string() + " " + b.to_string(), map_.ask(&v1::Map::Stub::TransformBetween, request));
  }
  void route(FrameId a, FrameId b) {
    for (const v1::RouteBy by : {v1::ROUTE_BY_DISTANCE, v1::ROUTE_BY_TIME}) {
      v1::FindRouteRequest request;
      *request.mutable_from()->mutable_frame() = to_wire(a);
      *request.mutable_to()->mutable_frame() = to_wire(b);
      request.set_by(by);
      auto reply = map_.find_route(request);
      ASSERT_TRUE(reply.ok()) << reply.status().to_string();
      reply->mutable_summary()->clear_map_version();
      remember("route " + a.to_string() + " " + b.to_string(), *reply);
    }
  }
  // Localises by the content of the keyframe, as a robot would.
  void place(const Keyframe& keyframe) {
    v1::LocaliseRequest where;
    *where.mutable_view()->mutable_features() = to_wire(keyframe.appearance);
    where.mutable_view()->set_session(1);
    note("localise " + std::to_string(keyframe.sequence), map_.ask(&v1::Map::Stub::Localise, where));
    v1::MatchImageRequest what;
    *what.mutable_view() = where.view();
    note("match " + std::to_string(keyframe.sequence), map_.ask(&v1::Map::Stub::MatchImage, what));
  }

  MapStub map_;
  const std::vector<Keyframe>& keyframes_;
  std::vector<std::string> answers_;
};

// Clients that continuously ask which place their pictures show.
class PictureCallers {
 public:
  PictureCallers(const std::string& address, int callers) {
    for (int i = 0; i < 4; ++i) pictures_.push_back(picture(i));
    for (int i = 0; i < callers; ++i) threads_.emplace_back([this, address, i] { ask(address, i); });
  }
  ~PictureCallers() { finish(); }

  // Pictures that were described and looked up.
  int finish() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
    return answered_;
  }

 private:
  // From a telephone's picture to an industrial camera's, with corners all over.
  struct Kind {
    int width, height;
    const char* format;
  };
  static const Kind& kind_of(int i) {
    static constexpr Kind kKinds[] = {
        {4000, 3000, ".jpg"}, {512, 384, ".png"}, {3200, 2400, ".png"}, {1280, 960, ".jpg"}};
    return kKinds[i % 4];
  }
  static std::string picture(int i) {
    const Kind& kind = kind_of(i);
    cv::Mat grey(kind.height, kind.width, CV_8UC1);
    cv::RNG random(static_cast<std::uint64_t>(i) + 1);
    random.fill(grey, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(grey, grey, {}, kind.width / 300.0);
    cv::normalize(grey, grey, 0, 255, cv::NORM_MINMAX);
    std::vector<std::uint8_t> bytes;
    cv::imencode(kind.format, grey, bytes);
    return {bytes.begin(), bytes.end()};
  }

  void ask(const std::string& address, int i) {
    MapStub map(address);
    v1::MatchImageRequest request;
    for (int n = i; !stop_; ++n) {
      const Kind& kind = kind_of(n);
      *request.mutable_view()->mutable_camera() =
          to_wire(StereoCamera{0.8 * kind.width, kind.width / 2.0, kind.height / 2.0, 0.12, kind.width, kind.height});
      request.mutable_view()->mutable_left()->set_data(pictures_[static_cast<std::size_t>(n % 4)]);
      const auto reply = map.ask(&v1::Map::Stub::MatchImage, request);
      // An empty map answers so only after it has described the picture; a small budget may have no room for all four.
      if (reply.ok() || reply.reason() == Reason::EMPTY_MAP) {
        ++answered_;
      } else if (reply.reason() != Reason::BUDGET_EXCEEDED) {
        ADD_FAILURE() << reply.status().to_string();
        return;
      }
    }
  }

  std::vector<std::string> pictures_;
  std::atomic<bool> stop_{false};
  std::atomic<int> answered_{0};
  std::vector<std::thread> threads_;
};

struct Size {
  std::uint32_t frames, frames_per_lap;
  std::size_t budget_mb;
  std::size_t beside_mb;  // program, libraries, vocabulary, stacks, what the allocator keeps
  bool closures_on_the_way;
};
constexpr std::size_t kPicturesMb = 200;  // the same, with a picture at a time
constexpr int kCallers = 4;

class MemoryBudget : public ::testing::Test {
 protected:
  void hold(const Size& size, int samples) {
    const std::string drive = folder_ / "drive";
    ASSERT_EQ(
        run_program({built_program("relmap-sim"), "points", "--out", drive, "--frames", std::to_string(size.frames),
                     "--frames-per-lap", std::to_string(size.frames_per_lap), "--appearance", "300"},
                    std::chrono::minutes(5))
            .exit_code,
        0);
    const std::size_t recorded = std::filesystem::file_size(drive + "/keyframes.bin");
    ASSERT_GT(recorded, size.budget_mb * kMegabyte * 5 / 2) << "no test of a budget";
    const std::vector<Keyframe> keyframes = read_keyframes(drive + "/keyframes.bin");
    DaemonOptions options{
        .data = folder_ / "map", .lcm = random_lcm_url(), .memory_budget_mb = size.budget_mb, .more = {}};
    const std::size_t bound = (size.budget_mb + size.beside_mb) * kMegabyte;

    take_in(options, drive, size, (size.budget_mb + kPicturesMb) * kMegabyte);
    options.lcm.clear();
    const std::vector<std::string> narrow = answers(options, keyframes, samples, bound);
    options.memory_budget_mb = kPlentyMb;
    const std::vector<std::string> wide = answers(options, keyframes, samples, kPlentyMb * kMegabyte);
    ASSERT_EQ(narrow.size(), wide.size());
    for (std::size_t i = 0; i < wide.size(); ++i) EXPECT_EQ(narrow[i], wide[i]);
    EXPECT_GT(wide.size(), keyframes.size() + static_cast<std::size_t>(samples) * 6);
  }

 private:
  void take_in(const DaemonOptions& options, const std::string& drive, const Size& size, std::size_t bound) {
    DaemonOptions ingest = options;
    if (!size.closures_on_the_way) ingest.more = {"--no-closures"};
    RunningDaemon daemon(ingest);
    PictureCallers callers(daemon.address(), kCallers);
    const Finished fed = run_program({built_program("relmap-frontend"), "--source", "sim", drive, "--robot", "walker",
                                      "--lcm", options.lcm, "--spool", folder_ / "spool", "--quiet"},
                                     std::chrono::minutes(10));
    EXPECT_EQ(fed.exit_code, 0) << fed.standard_error;
    client::ClientOptions patient;
    patient.deadline = std::chrono::minutes(10);
    auto client = client::Client::connect(options.data, patient).or_throw();
    ASSERT_TRUE(client->wait_idle().ok());
    const int pictures = callers.finish();
    EXPECT_GT(pictures, 2 * kCallers);
    const client::DaemonStatus status = client->status().or_throw();
    EXPECT_EQ(status.frames, size.frames);
    if (size.closures_on_the_way) {
      EXPECT_GT(status.closures_accepted, 0u);
    }
    expect_within(daemon, bound, "taking the map in under " + std::to_string(pictures) + " pictures");
    client.reset();
    EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  }

  std::vector<std::string> answers(const DaemonOptions& options, const std::vector<Keyframe>& keyframes, int samples,
                                   std::size_t bound) {
    RunningDaemon daemon(options);
    EXPECT_TRUE(daemon.client()->wait_idle().ok());
    auto answers = Questions(daemon.address(), keyframes).ask(samples);
    expect_within(daemon, bound, std::to_string(options.memory_budget_mb) + " MB");
    EXPECT_EQ(daemon.stop(), 0) << daemon.log();
    return answers;
  }

  void expect_within(RunningDaemon& daemon, std::size_t bound, const std::string& what) {
    const std::size_t peak = daemon.process().peak_resident_bytes();
    EXPECT_LE(peak, bound) << what;
    std::printf("%s: %zu MB resident at most, allowed %zu\n", what.c_str(), peak / kMegabyte, bound / kMegabyte);
  }

  const storage::TemporaryFolder folder_;
};

// Without pictures the bound is tight enough that an unbounded cache would exceed it.
TEST_F(MemoryBudget, HoldsAMapSeveralTimesLargerAndAnswersTheSame) { hold({2000, 700, 32, 105, false}, 10); }

class LongMemoryBudget : public MemoryBudget {};

TEST_F(LongMemoryBudget, HoldsAMapSeveralTimesLargerAndAnswersTheSame) { hold({6000, 2500, 64, 130, true}, 40); }

}  // namespace
}  // namespace relmap::testing
