// relmap ingest: takes recordings into the map, several at a time.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <optional>
#include <ostream>
#include <thread>
#include <utility>

#include "proto/base/number_text.h"
#include "tools/batch/again.h"
#include "tools/batch/batch.h"
#include "tools/batch/batch_progress.h"
#include "tools/batch/batch_report.h"
#include "tools/relmap/commands.h"
#include "tools/terminal/interrupt.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::cli {

namespace {

using Clock = std::chrono::steady_clock;

struct IngestOptions {
  std::vector<std::string> paths;
  batch::BatchOptions batch;
  bool deterministic = false;
};

Clock::duration as_duration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

std::size_t usual_jobs() { return std::max(1u, std::thread::hardware_concurrency() / 2); }

std::string default_summaries() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  const std::string base = state && *state ? state : std::string(home && *home ? home : ".") + "/.local/state";
  return base + "/relmap/ingest";
}

// Waits until places are looked up and loops closed, which happens after keyframes are in the map. Robots that drive
// meanwhile may keep the daemon busy for ever, so the wait ends after a minute without progress. `answered` becomes the
// time of the daemon's last answer.
Status wait_for_loops(client::Client& client, terminal::Console& console, Clock::time_point& answered) {
  constexpr std::chrono::minutes kMaxStandstill{1};
  terminal::ProgressBar bar(console.err(), terminal::is_terminal());
  std::uint64_t max_left = 0, min_left = UINT64_MAX;
  auto progressed = Clock::now();
  while (!terminal::interrupted()) {
    if (Clock::now() - progressed >= kMaxStandstill) {
      console.err()
          << "the places of " << counted_text(min_left, "frame")
          << " still wait to be recognised, without progress for a minute; the report is of the map as it is\n";
      break;
    }
    const auto status = client.status();
    if (!status.ok()) return status.status();
    answered = Clock::now();
    const std::uint64_t left = status->queued + status->lookup_lag + status->pending_frames;
    if (left == 0 && status->applied_sequence == status->durable_sequence) break;
    max_left = std::max(max_left, left);
    if (left < min_left) {
      min_left = left;
      progressed = Clock::now();
    }
    bar.show("recognising places and relaxing what they close", max_left - left, max_left, "frames");
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return {};
}

struct MapNow {
  std::vector<client::Session> sessions = {};
  std::vector<client::Edge> loops = {};
  std::vector<client::DoubtfulCamera> doubts = {};
  std::string boot = {};  // boot id of the daemon that reported `doubts`; empty: they are not known
  Status status = {};     // why some of this is not known
};

MapNow map_now(client::Client& client) {
  MapNow now;
  auto sessions = client.sessions();
  client::EdgeFilter accepted_loops;
  accepted_loops.states = {client::EdgeState::kAccepted};
  accepted_loops.kinds = {client::EdgeKind::kLoop};
  auto loops = sessions.ok() ? client.edges(accepted_loops) : Result<std::vector<client::Edge>>(sessions.status());
  now.status = loops.status();
  if (sessions.ok()) now.sessions = std::move(*sessions);
  if (loops.ok()) now.loops = std::move(*loops);
  if (auto status = client.status(); status.ok()) {
    now.doubts = std::move(status->doubtful_cameras);
    now.boot = status->boot_id;
  }
  return now;
}

bool is_away(const Status& status) {
  return status.reason() == Reason::UNREACHABLE || status.reason() == Reason::SHUTTING_DOWN;
}

// The sessions of the map. Waits up to `patience` for a daemon that is away, as front-ends do.
Result<std::vector<client::Session>> known_sessions(client::Client& client, Clock::duration patience,
                                                    terminal::Console& console) {
  auto sessions = client.sessions();
  if (is_away(sessions.status())) console.err() << sessions.status().to_string() << "; waiting for it\n";
  for (const auto begun = Clock::now();
       is_away(sessions.status()) && !terminal::interrupted() && Clock::now() - begun < patience;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    if (const auto found = client.connect_again(); found.ok()) sessions = (*found)->sessions();
  }
  return sessions;
}

// The map after the last recording. The daemon may have been restarted meanwhile, at another port, so it is looked up
// again, as front-ends do. If it does not answer, or is shutting down, waits for it up to `patience`.
MapNow map_at_rest(const client::Client& client, Clock::duration patience, terminal::Console& console) {
  bool told = false;
  for (auto answered = Clock::now();;) {
    MapNow now;
    if (const auto found = client.connect_again(); found.ok()) {
      const Status waited = wait_for_loops(**found, console, answered);
      if (!is_away(waited)) now = map_now(**found);
      if (!waited.ok()) now.status = waited;
    } else {
      now.status = found.status();
    }
    if (!is_away(now.status) || terminal::interrupted() || Clock::now() - answered >= patience) return now;
    if (!std::exchange(told, true)) console.err() << now.status.to_string() << "; waiting for it\n";
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

void print(const std::vector<batch::ReportRow>& rows, double wall_s, terminal::Console& console) {
  if (console.json)
    console.out() << batch::report_json(rows, wall_s) << '\n';
  else
    batch::print_report(rows, console);
}

// Tells what a front-end by itself would say first; the output of those in a batch is not shown.
void tell_supposed(const std::vector<batch::Sequence>& sequences, std::ostream& err) {
  for (const batch::Sequence& sequence : sequences)
    if (sequence.supposed_rate_hz > 0)
      err << sequence.path << ": nothing tells the times of its pairs (no times.txt); "
          << number_text(sequence.supposed_rate_hz)
          << " pairs a second are assumed, and speeds and travel times follow "
          << "from that\n";
}

// Tells which folders and files in a folder of photographs are not taken in.
void tell_passed_over(const std::vector<batch::Sequence>& sequences, std::ostream& err) {
  std::string told;
  for (const batch::Sequence& sequence : sequences) {
    if (std::exchange(told, sequence.path) == sequence.path) continue;  // another camera's of the same folder
    if (const auto& folders = sequence.folders_passed_over; !folders.empty()) {
      err << sequence.path << ": " << counted_text(folders.size(), "folder")
          << (folders.size() == 1 ? " in it is" : " in it are") << " passed over; each is a recording of its own:";
      for (const std::string& folder : folders) err << ' ' << sequence.path << '/' << folder;
      err << '\n';
    }
    if (const auto& files = sequence.files_passed_over; !files.empty()) {
      err << sequence.path << ": " << counted_text(files.size(), "file") << (files.size() == 1 ? " is" : " are")
          << " passed over, neither PNG nor JPEG nor PGM:";
      for (const std::string& file : files) err << ' ' << file;
      err << '\n';
    }
  }
}

// Continues the sessions of an interrupted --again. A recording that has changed since becomes another new session.
Status take_up(const batch::AgainRecord& again, const batch::BatchOptions& options,
               const std::vector<client::Session>& known, std::vector<batch::Sequence>& sequences, std::ostream& err) {
  const batch::SummaryStore store(options.summaries, options.map);
  return again.take_up(sequences, [&](const SessionUuid& uuid, const batch::Sequence& sequence) {
    const auto session =
        std::find_if(known.begin(), known.end(), [&](const client::Session& s) { return s.uuid == uuid.to_string(); });
    if (session == known.end()) return false;
    const std::string change = batch::change_since(*session, sequence, options.recordings.mono, store.read(uuid));
    if (change.empty()) return false;
    err << sequence.session << ": of the interrupted --again " << change << ": it becomes another new session; relmap "
        << "session delete " << session->number << " removes the unfinished one\n";
    return true;
  });
}

// Why some recordings are not in the map, and which command takes them in; ok if all are. `again`: --again was given.
Status failure_of(const std::vector<batch::Task>& tasks, bool again) {
  std::size_t failed = 0, changed = 0, deleted = 0;
  Reason first = Reason::OK;
  for (const batch::Task& task : tasks) {
    if (task.stage != batch::Stage::kFailed) continue;
    if (failed++ == 0) first = task.failure.reason();
    changed += task.failure.reason() == Reason::SEQUENCE_CONFLICT;
    deleted += task.failure.reason() == Reason::SESSION_DELETED;
  }
  if (failed == 0) return {};
  std::string what = std::to_string(failed) + " of " + std::to_string(tasks.size()) + " recordings failed";
  if (changed > 0)
    what += "; " + std::to_string(changed) + " changed since the map has " + (changed == 1 ? "it" : "them");
  if (deleted > 0) what += "; " + std::to_string(deleted) + (deleted == 1 ? " was" : " were") + " deleted from the map";
  const std::size_t refused = changed + deleted;
  if (refused > 0)
    what += std::string("; ") + (again ? "the same command" : "relmap ingest --again") + " takes " +
            (refused == 1 ? "it in as another session" : "them in as other sessions");
  if (refused < failed)
    what += std::string("; the same command tries ") +
            (refused > 0   ? "the others"
             : failed == 1 ? "it"
                           : "them") +
            " again, and leaves out what is in the map";
  return {first, what};
}

// How long to wait at the end for a daemon that does not answer: not at all if a front-end has given it up already.
Clock::duration patience_with_daemon(const std::vector<batch::Task>& tasks, const batch::BatchOptions& how) {
  const bool lost = std::any_of(tasks.begin(), tasks.end(),
                                [](const batch::Task& task) { return task.failure.reason() == Reason::UNREACHABLE; });
  return lost ? Clock::duration{} : as_duration(how.patience_s);
}

Status ingest(const IngestOptions& options, client::Client& client, terminal::Console& console) {
  const terminal::Console::Aside aside(console);
  const auto daemon = client.status();
  if (!daemon.ok()) return daemon.status();
  if (options.deterministic && !daemon->deterministic)
    return {Reason::INVALID_ARGUMENT,
            "--deterministic needs a daemon that was started with it: relmapd --deterministic"};
  batch::BatchOptions how = options.batch;
  if (daemon->map.known()) how.map = daemon->map.uuid.to_string();
  auto sequences = batch::sequences_of(options.paths, how.recordings, batch::front_end_lister());
  if (!sequences.ok()) return sequences.status();
  tell_passed_over(*sequences, console.err());
  tell_supposed(*sequences, console.err());
  terminal::watch_interrupts();  // until here, a signal simply ends the program
  const auto known = known_sessions(client, as_duration(how.patience_s), console);
  if (!known.ok()) return known.status();
  std::optional<batch::AgainRecord> again;
  if (how.recordings.again) {
    again.emplace(how.summaries, how.map.empty() ? how.server : how.map, how.recordings, *sequences);
    if (Status status = take_up(*again, how, *known, *sequences, console.err()); !status.ok()) return status;
  }

  const auto begun = Clock::now();
  batch::Batch work(how, *sequences, *known);
  {
    batch::BatchProgress progress(console.err(), terminal::is_terminal());
    work.run(terminal::interrupted, [&](const auto& tasks) { progress.show(tasks); });
  }
  console.report(work.not_kept());
  const MapNow map = map_at_rest(client, patience_with_daemon(work.tasks(), how), console);
  const double wall_s = std::chrono::duration<double>(Clock::now() - begun).count();
  auto rows = batch::report_rows(work.tasks(), map.sessions, map.loops, map.doubts);
  console.report(batch::keep_doubts({how.summaries, how.map}, map.boot, rows));
  print(rows, wall_s, console);
  if (again)
    for (const batch::Task& task : work.tasks())
      if (const Reason reason = task.failure.reason();
          reason == Reason::SEQUENCE_CONFLICT || reason == Reason::SESSION_DELETED)
        if (Status status = again->forget(task.sequence); !status.ok()) return status;
  if (terminal::interrupted()) return {Reason::SHUTTING_DOWN, "interrupted; the same command goes on"};
  if (Status failure = failure_of(work.tasks(), how.recordings.again); !failure.ok()) {
    console.outcome_told = true;
    return failure;
  }
  if (again) again->done();
  console.incomplete = std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.lost() > 0; });
  console.untrusted = std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.untrusted(); });
  return map.status;
}

}  // namespace

void add_ingest(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("ingest", "take recordings into the map, several at a time; resumes where it was interrupted");
  auto options = std::make_shared<IngestOptions>();
  batch::BatchOptions& how = options->batch;
  how.jobs = usual_jobs();
  how.summaries = default_summaries();
  command
      ->add_option("PATH", options->paths,
                   "the recordings: folders of pictures, files of keyframes, logs of lcm-logger")
      ->type_name("FILE|FOLDER")
      ->required();
  command->add_option("--source", how.recordings.source, "kind of the recordings; auto recognises it")
      ->check(CLI::IsMember({"auto", "kitti", "euroc", "images", "sim", "raw", "log"}))
      ->capture_default_str();
  auto* const jobs = command->add_option("--jobs", how.jobs, "recordings taken in at a time")
                         ->check(CLI::Range(std::size_t{1}, std::size_t{1024}))
                         ->capture_default_str();
  command
      ->add_flag(
          "--deterministic", options->deterministic,
          "take them in one after the other, in the order given, so that the map is the same every time, even after "
          "interruptions; needs relmapd --deterministic")
      ->excludes(jobs);
  command
      ->add_option(
          "--robot", how.recordings.robot,
          "robot that the sessions belong to (default: as recorded in logs and files of keyframes, else batch)")
      ->type_name("NAME");
  command->add_option("--calibration", how.recordings.calibration, "calibration for folders of pictures that hold none")
      ->type_name("FILE|FOLDER");
  command->add_flag(
      "--mono", how.recordings.mono,
      "the folders hold photographs of single cameras: a session for each camera, without scale; relmap match "
      "finds places in it, relmap localise does not");
  command->add_flag("--again", how.recordings.again,
                    "make new sessions, even of recordings that the map has; resumes if interrupted");
  command->add_flag("--despite-check", how.despite_check,
                    "take recordings in even if their first pairs show that the stereo pair is wrong; exit code 5");
  command
      ->add_option("--patience", how.patience_s,
                   "give a recording up if the daemon makes no progress for so many seconds")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  command->footer(
      "Each recording becomes a session; a recording that is in the map already is left out. After an interruption, "
      "give\n"
      "the same command again: it resumes. The command ends when places are recognised and loops closed, or after a\n"
      "minute without progress in that. A summary of each recording is kept in $XDG_STATE_HOME/relmap/ingest\n"
      "(~/.local/state/relmap/ingest), one file for each session.\n\n"
      "A recording that has changed since its session was made (other pictures, more of them, another calibration) "
      "fails\n"
      "with SEQUENCE_CONFLICT; --again takes it in as a new session.\n\n"
      "Examples:\n"
      "  relmap ingest --source kitti ~/kitti/sequences/* --jobs 4\n"
      "  relmap ingest lcmlog-2026-11-21.00             # the sessions that lcm-logger recorded\n"
      "  relmap ingest keyframes.bin                    # robot and session as recorded in the file\n"
      "  relmap ingest --mono photos/ --robot phone     # a session for each camera; subfolders are passed over\n"
      "  relmap ingest --deterministic drive-1 drive-2  # the same map every time; needs relmapd --deterministic\n"
      "  relmap --json ingest drive/ | jq '.sequences[]? | select(.error)'\n"
      "\n"
      "Exit codes:\n"
      "  0  all recordings are in the map\n"
      "  1  some failed, or the command was interrupted. A recording whose stereo pair is plainly wrong (NOT_STEREO,\n"
      "     ROWS_APART, EYE_DEAD) fails before any of it is in the map\n"
      "  2  wrong usage\n"
      "  3  no daemon answers, or the daemon refused keyframes (the report begins with these; keyframes that a\n"
      "     recording itself lacks do not count)\n"
      "  5  all are in the map, but some cannot be trusted: fewer than 80 % of the expected pairs were measured, or "
      "the\n"
      "     cameras or the map contradict the calibration (WRONG_CALIBRATION)");
  command->callback([&app, &action, options] {
    options->batch.server = app.get_option("--server")->as<std::string>();
    if (const CLI::Option* shown = app.get_option("--credentials"); shown->count() > 0)
      options->batch.credentials = shown->as<std::string>();
    if (options->deterministic) options->batch.jobs = 1;
    action = [options](client::Client& client, terminal::Console& console) {
      return ingest(*options, client, console);
    };
  });
}

}  // namespace relmap::cli
