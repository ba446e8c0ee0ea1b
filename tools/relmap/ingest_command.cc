// relmap ingest: recordings into the map, many at a time.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <optional>
#include <ostream>
#include <thread>

#include "tools/batch/again.h"
#include "tools/batch/batch.h"
#include "tools/batch/batch_progress.h"
#include "tools/batch/batch_report.h"
#include "tools/console/interrupt.h"
#include "tools/console/progress_bar.h"
#include "tools/relmap/commands.h"

namespace relmap::cli {

namespace {

using Clock = std::chrono::steady_clock;

struct IngestOptions {
  std::vector<std::string> paths;
  batch::BatchOptions batch;
  bool deterministic = false;
};

std::size_t usual_jobs() { return std::max(1u, std::thread::hardware_concurrency() / 2); }

std::string default_summaries() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const std::string base = state && *state ? state : std::string(home && *home ? home : ".") + "/.local/state";
  return base + "/relmap/ingest";
}

// Places are looked up, and loops closed, after keyframes are in the map. Robots that drive meanwhile keep the daemon
// busy: after a minute without getting nearer to the end the map is told as it is.
Status wait_for_loops(client::Client& client, Console& console) {
  constexpr std::chrono::minutes kNoNearer{1};
  ProgressBar bar(console.err(), is_terminal());
  std::uint64_t most = 0, least = UINT64_MAX;
  auto nearer = Clock::now();
  while (!interrupted() && Clock::now() - nearer < kNoNearer) {
    const auto status = client.status();
    if (!status.ok()) return status.status();
    const std::uint64_t left = status->queued + status->lookup_lag + status->pending_frames;
    if (left == 0 && status->applied_sequence == status->durable_sequence) break;
    most = std::max(most, left);
    if (left < least) {
      least = left;
      nearer = Clock::now();
    }
    bar.show("recognising places and relaxing what they close", most - left, most, "frames");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return {};
}

// What the map has of them now; what the daemon does not say is left out.
Status report(const batch::Batch& work, double wall_s, client::Client& client, Console& console) {
  const auto sessions = client.sessions();
  client::EdgeFilter accepted_loops;
  accepted_loops.states = {client::EdgeState::kAccepted};
  accepted_loops.kinds = {client::EdgeKind::kLoop};
  const auto loops =
      sessions.ok() ? client.edges(accepted_loops) : Result<std::vector<client::Edge>>(sessions.status());
  const auto rows = batch::report_rows(work.tasks(), sessions.ok() ? *sessions : std::vector<client::Session>(),
                                       loops.ok() ? *loops : std::vector<client::Edge>());
  if (console.json)
    console.out() << batch::report_json(rows, wall_s) << '\n';
  else
    batch::print_report(rows, console);
  return loops.status();
}

Status ingest(const IngestOptions& options, client::Client& client, Console& console) {
  const Console::Aside aside(console);
  const auto daemon = client.status();
  if (!daemon.ok()) return daemon.status();
  if (options.deterministic && !daemon->deterministic)
    return {Reason::INVALID_ARGUMENT,
            "--deterministic needs a daemon that was started with it: relmapd --deterministic"};
  auto sequences = batch::sequences_of(options.paths, options.batch.recordings, batch::front_end_lister());
  if (!sequences.ok()) return sequences.status();
  std::optional<batch::AgainRecord> again;
  if (options.batch.recordings.again) {
    const std::string map = daemon->map.known() ? daemon->map.uuid.to_string() : options.batch.server;
    again.emplace(options.batch.summaries, map, options.batch.recordings, *sequences);
    if (Status status = again->take_up(*sequences); !status.ok()) return status;
  }
  const auto known = client.sessions();
  if (!known.ok()) return known.status();

  watch_interrupts();
  const auto begun = Clock::now();
  batch::Batch work(options.batch, *sequences, *known);
  {
    batch::BatchProgress progress(console.err(), is_terminal());
    work.run(interrupted, [&](const auto& tasks) { progress.show(tasks); });
  }
  const Status waited = wait_for_loops(client, console);
  const double wall_s = std::chrono::duration<double>(Clock::now() - begun).count();
  const Status reported = report(work, wall_s, client, console);
  if (interrupted()) return {Reason::SHUTTING_DOWN, "interrupted; the same command goes on"};
  std::size_t failed = 0;
  Reason first = Reason::OK;
  for (const batch::Task& task : work.tasks())
    if (task.stage == batch::Stage::kFailed && failed++ == 0) first = task.failure.reason();
  if (failed == 0 && again) again->done();
  if (failed == 0) {
    console.untrusted =
        std::any_of(work.tasks().begin(), work.tasks().end(), [](const batch::Task& task) { return task.untrusted(); });
    return waited.ok() ? reported : waited;
  }
  return {first, std::to_string(failed) + " of " + std::to_string(work.tasks().size()) +
                     " recordings failed; the same command tries them again, and leaves out what is in the map"};
}

}  // namespace

void add_ingest(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("ingest", "take recordings into the map, many at a time; goes on where it was interrupted");
  auto options = std::make_shared<IngestOptions>();
  batch::BatchOptions& how = options->batch;
  how.jobs = usual_jobs();
  how.summaries = default_summaries();
  command->add_option("PATH", options->paths, "recordings: folders of pictures, files of keyframes, logs of lcm-logger")
      ->required();
  command->add_option("--source", how.recordings.source, "what they are; auto: what they look like")
      ->check(CLI::IsMember({"auto", "kitti", "euroc", "images", "sim", "raw", "lcmlog"}))
      ->capture_default_str();
  auto* const jobs = command->add_option("--jobs", how.jobs, "recordings at a time")
                         ->check(CLI::Range(std::size_t{1}, std::size_t{1024}))
                         ->capture_default_str();
  command
      ->add_flag(
          "--deterministic", options->deterministic,
          "one after the other, in the order given, by a daemon that was started with it: the same map every time, "
          "however often it is interrupted")
      ->excludes(jobs);
  command->add_option("--robot", how.recordings.robot, "whose they are (default: as recorded, or batch)");
  command->add_option("--calibration", how.recordings.calibration, "for folders that hold none");
  command->add_flag(
      "--mono", how.recordings.mono,
      "pictures of one camera: places without metres, that relmap match finds and relmap localise does not");
  command->add_flag("--again", how.recordings.again,
                    "as new sessions, though the map may have them; interrupted, it goes on");
  command->add_flag("--despite-check", how.despite_check,
                    "take recordings in though their first pairs show that the eyes are wrong; ends with 5");
  command->add_option("--patience", how.patience_s, "seconds without progress before a recording is given up")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  command->footer(
      "The same command goes on where it was interrupted. It ends when places are recognised and loops closed, or "
      "after a\n"
      "minute in which that came no nearer. Summaries of front-ends, for the report of a later run, lie in\n"
      "$XDG_STATE_HOME/relmap/ingest (~/.local/state/relmap/ingest), a file for each session.\n\n"
      "Examples:\n"
      "  relmap ingest --source kitti ~/kitti/sequences/* --jobs 4\n"
      "  relmap ingest lcmlog-2026-11-21.00             # sessions as lcm-logger recorded them\n"
      "  relmap ingest --mono photos/ --robot phone\n"
      "  relmap ingest --deterministic drive-1 drive-2  # the same map every time; needs relmapd --deterministic\n"
      "  relmap --json ingest drive/ | jq '.sequences[] | select(.error)'\n"
      "Exit codes: 0 all are in the map; 1 some failed, or it was interrupted; 2 wrong usage; 3 no daemon answers;\n"
      "5 all are in the map, and some are not to be trusted: fewer than 80 % of the pairs that there should be were\n"
      "measured, or the eyes are not as the calibration says. A recording whose eyes are plainly wrong (NOT_STEREO,\n"
      "ROWS_APART, EYE_DEAD) fails before any of it is in the map.");
  command->callback([&app, &action, options] {
    options->batch.server = app.get_option("--server")->as<std::string>();
    if (options->batch.recordings.source == "lcmlog") options->batch.recordings.source = "log";
    if (options->deterministic) options->batch.jobs = 1;
    action = [options](client::Client& client, Console& console) { return ingest(*options, client, console); };
  });
}

}  // namespace relmap::cli
