// relmap-bench skeleton: what a picture of a large map costs, through a daemon at its Unix socket. The map is a city of
// known shape (tests/support/skeleton_city.h); a folder that is given keeps it for the next run.
#include <fcntl.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "client/skeleton_relaxation.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/running_daemon.h"
#include "tests/support/skeleton_city.h"
#include "tests/support/stored_map.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

namespace fs = std::filesystem;

struct SkeletonBenchOptions {
  testing::SkeletonCity city;
  std::string folder;
  std::uint32_t level = 1, rounds = 5;
  std::size_t memory_budget_mb = 512;
};

struct Streamed {
  double first_s = 0, whole_s = 0;
  std::uint64_t bytes = 0, messages = 0, largest = 0;
};

Streamed stream(v1::Map::Stub& stub, std::uint32_t level) {
  grpc::ClientContext context;
  v1::GetSkeletonRequest request;
  request.set_level(level);
  v1::GetSkeletonReply reply;
  Streamed streamed;
  const auto begin = Clock::now();
  const auto reader = stub.GetSkeleton(&context, request);
  while (reader->Read(&reply)) {
    if (streamed.messages++ == 0) streamed.first_s = seconds_since(begin);
    const std::uint64_t bytes = reply.ByteSizeLong();
    streamed.bytes += bytes;
    streamed.largest = std::max(streamed.largest, bytes);
  }
  const grpc::Status end = reader->Finish();
  if (!end.ok()) throw std::runtime_error(end.error_message());
  streamed.whole_s = seconds_since(begin);
  return streamed;
}

double cpu_seconds(pid_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

// A daemon that has just started makes its index of routes.
void wait_until_quiet(pid_t pid) {
  for (double last = cpu_seconds(pid);;) {
    std::this_thread::sleep_for(std::chrono::seconds(3));
    const double now = cpu_seconds(pid);
    if (now - last < 0.15) return;
    last = now;
  }
}

void drop_from_page_cache(const std::string& folder) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const int file = ::open(entry.path().c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) continue;
    (void)::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
    ::close(file);
  }
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

void run(const SkeletonBenchOptions& options, Report& report) {
  std::optional<storage::TemporaryFolder> temporary;
  if (options.folder.empty()) temporary.emplace();
  const std::string folder = options.folder.empty() ? *temporary / "map" : options.folder;
  const auto begun = Clock::now();
  testing::build_city_folder(options.city, folder);
  report.add("build_s", seconds_since(begun), "to make the map, or what was missing of it");
  {
    const auto map = testing::open_stored_map(folder);
    const auto view = map->view();
    std::vector<double> scans;
    std::uint64_t frames = 0, closures = 0;
    for (std::uint32_t round = 0; round < options.rounds; ++round) {
      frames = closures = 0;
      const auto begin = Clock::now();
      throw_if(view->visit_digests({}, [&](const storage::ChunkDigest& digests) {
        frames += digests.frames.size();
        for (const storage::FrameDigest& frame : digests.frames) closures += frame.closures.size();
        return true;
      }));
      scans.push_back(seconds_since(begin));
    }
    report.add("frames", static_cast<double>(frames), "of the map");
    report.add("closures", static_cast<double>(closures), "of the map");
    report.add("digests_s", median(scans), "to read all digests, by storage's own API, median");
  }
  testing::RunningDaemon daemon(
      {.data = folder, .lcm = "", .memory_budget_mb = options.memory_budget_mb, .more = {"--log-level", "warning"}});
  const auto quiet = Clock::now();
  wait_until_quiet(daemon.process().pid());
  report.add("quiet_s", seconds_since(quiet), "until the daemon had made its index of routes");

  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(16 << 20);
  const auto channel = grpc::CreateCustomChannel("unix:" + fs::absolute(folder).string() + "/socket",
                                                 grpc::InsecureChannelCredentials(), arguments);
  const auto stub = v1::Map::NewStub(channel);
  drop_from_page_cache(folder);
  const Streamed cold = stream(*stub, options.level);
  report.add("cold_first_page_ms", 1e3 * cold.first_s, "of the first call, none of the files in memory");
  report.add("cold_whole_ms", 1e3 * cold.whole_s, "the same, whole");
  std::vector<double> first_ms, whole_ms;
  Streamed warm;
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    warm = stream(*stub, options.level);
    first_ms.push_back(1e3 * warm.first_s);
    whole_ms.push_back(1e3 * warm.whole_s);
  }
  report.add("first_page_ms", median(first_ms), "median");
  report.add("whole_ms", median(whole_ms), "median");
  report.add("wire_mb", static_cast<double>(warm.bytes) / 1e6, "of all messages");
  report.add("messages", static_cast<double>(warm.messages), "");
  report.add("largest_message_kb", static_cast<double>(warm.largest) / 1e3, "");
  for (std::uint32_t level = 0; level < 4; ++level) {
    if (level == options.level) continue;
    const Streamed other = stream(*stub, level);
    const std::string name = "level" + std::to_string(level) + "_";
    report.add(name + "whole_ms", 1e3 * other.whole_s, "at another level");
    report.add(name + "wire_mb", static_cast<double>(other.bytes) / 1e6, "");
  }

  const auto client = daemon.client();
  auto begin = Clock::now();
  const client::Skeleton skeleton = client->skeleton({.level = options.level}).or_throw();
  report.add("client_ms", 1e3 * seconds_since(begin), "to read it into the client's types");
  report.add("points", static_cast<double>(skeleton.points()), "");
  report.add("told_closures", static_cast<double>(skeleton.closures.size()), "");
  begin = Clock::now();
  const auto relaxed = client::relax_skeleton(skeleton).or_throw();
  report.add("relax_s", seconds_since(begin), "to lay it out in one frame");
  report.add("parts", static_cast<double>(relaxed.parts.size()), "that nothing connects");

  // How far the points are from the truth, where their part's root is taken for true.
  std::vector<double> errors;
  const client::RelaxedSkeleton::Part& part = relaxed.parts.front();
  const SE3 T_world_root = testing::true_way(options.city, part.root.session)[part.root.index];
  SessionNumber session = 0;
  std::vector<SE3> way;
  for (const auto& place : part.places) {
    if (place.frame.session != session) way = testing::true_way(options.city, session = place.frame.session);
    errors.push_back((T_world_root * place.T_root_frame.t - way[place.frame.index].t).norm());
  }
  report.add("error_m", median(errors), "of the points of the largest part, median");
  report.add("error_p99_m", quantile(errors, 0.99), "the same, 99th percentile");
  if (daemon.stop() != 0) throw std::runtime_error("the daemon failed: " + daemon.log());
}

}  // namespace

Run declare_skeleton(CLI::App& app) {
  const auto options = std::make_shared<SkeletonBenchOptions>();
  app.add_option("--frames", options->city.frames, "Frames of the map")->capture_default_str();
  app.add_option("--frames-per-session", options->city.frames_per_session, "Frames of each session")
      ->capture_default_str();
  app.add_option("--streets", options->city.streets, "Streets of the city in each direction")->capture_default_str();
  app.add_option("--folder", options->folder, "Data folder that keeps the map; default: a temporary one")
      ->type_name("DIR");
  app.add_option("--level", options->level, "Level of the skeleton")->check(CLI::Range(0, 3))->capture_default_str();
  app.add_option("--rounds", options->rounds, "Calls")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Of the daemon")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
