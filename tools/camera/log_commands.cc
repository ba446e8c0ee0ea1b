// record and replay: write raw frames to a log, and give a log to the front-end.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "frontend/capture/raw_log_reader.h"
#include "frontend/capture/raw_log_writer.h"
#include "proto/base/clock.h"
#include "proto/base/json.h"
#include "proto/base/quantile.h"
#include "tools/camera/commands.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::camera {

namespace {

struct RecordOptions {
  std::string file, camera, calibration;
  double seconds = 0, rate_hz = 0;
  std::uint64_t frames = 0;
};

// Records raw frames to wish.file until a limit, an interrupt or a full disk.
Result<ExitCode> record(const GlobalOptions& options, terminal::Console& console, const RecordOptions& wish) {
  using Clock = std::chrono::steady_clock;
  auto buses = iidc::open_camera_buses(options.bus);
  if (!buses.ok()) return buses.status();
  const iidc::IidcOptions iidc{wish.camera, options.camera_folder, wish.calibration, wish.rate_hz};
  const std::atomic<bool>& stop = stop_flag();
  auto camera = iidc::open_camera(std::move(*buses), iidc, stop);
  if (!camera.ok()) return camera.status();
  const auto calibration = iidc::calibration_of(*camera, iidc);
  if (!calibration.ok() && calibration.reason() != Reason::NO_CALIBRATION) return calibration.status();
  if (!calibration.ok())
    console.err() << calibration.status().message()
                  << "; the recording has none, so give --calibration when it is read\n";
  const iidc::CameraAddress& address = camera->live->address();
  capture::RawLogHeader header;
  header.vendor = address.vendor;
  header.model = address.model;
  header.serial = address.serial;
  header.layout = camera->layout;
  header.embedded = camera->live->stamped() ? 1 : 0;
  header.rate_hz = camera->live->format().rate_hz;
  if (calibration.ok()) header.calibration = *calibration;
  auto log = capture::RawLogWriter::open(wish.file, header);
  if (!log.ok()) return log.status();
  if (!options.quiet)
    console.err() << address.model << ' ' << address.serial << ": " << camera->live->format().describe() << '\n';

  terminal::ProgressBar bar(console.err(), terminal::is_terminal());
  const auto begin = Clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  Status failure;
  std::uint64_t recorded = 0;
  std::uint64_t lost = 0;  // frames that the log has been told of as lost
  while (!stop && (wish.frames == 0 || recorded < wish.frames) && (wish.seconds == 0 || elapsed() < wish.seconds)) {
    const auto frame = camera->live->next();
    if (!frame.ok()) {
      bar.end();
      console.err() << frame.status().to_string() << '\n';
      const std::uint64_t all = camera->live->counts().lost;
      failure = (*log)->add_event({now_us(), frame.reason(), frame.status().message(), all - std::exchange(lost, all)});
    } else if (frame->has_value()) {
      const iidc::LiveFrame& live = **frame;
      failure = (*log)->add_frame({live.time_us, live.cycle, live.index}, live.raw.bytes());
      ++recorded;
    }
    if (failure.reason() == Reason::IO_ERROR || failure.reason() == Reason::DISK_FULL) break;
    if (options.quiet) continue;
    if (wish.frames > 0)
      bar.show("recording", recorded, wish.frames, "frames");
    else
      bar.show("recording", static_cast<std::uint64_t>(elapsed()), static_cast<std::uint64_t>(wish.seconds), "seconds");
  }
  bar.end();
  const Status closed = (*log)->close();
  const capture::RawLogCounts counts = (*log)->counts();
  const iidc::LiveCounts live = camera->live->counts();
  if (options.json) {
    std::vector<Json> faults;
    for (const auto& [reason, count] : live.faults)
      faults.push_back(Json().add("reason", reason_name(reason)).add("count", count));
    Json json;
    json.add("file", wish.file)
        .add("frames", counts.frames)
        .add("bytes", counts.bytes)
        .add("seconds", elapsed())
        .add("lost", live.lost)
        .add("dropped", counts.dropped_frames)
        .add("reopened", live.reopened)
        .add("faults", faults);
    if (live.drift_ppm) json.add("clock_drift_ppm", *live.drift_ppm);
    console.reply(json.text());
  } else {
    std::vector<std::pair<std::string, std::string>> facts = {
        {"frames", std::to_string(counts.frames) + " in " + terminal::duration_text(elapsed()) + ", " +
                       terminal::bytes_text(counts.bytes)},
        {"lost", std::to_string(live.lost) + " by the camera, " + std::to_string(counts.dropped_frames) +
                     " since the disk is too slow"}};
    for (const auto& [reason, count] : live.faults)
      facts.push_back({std::string(reason_name(reason)), std::to_string(count)});
    if (live.drift_ppm) facts.push_back({"its clock", terminal::fixed(*live.drift_ppm, 1) + " ppm fast"});
    console.facts(facts);
  }
  if (!closed.ok()) return closed;
  return stop ? kInterrupted : kOk;
}

struct ReplayOptions {
  std::string file;
  std::string rate = "recorded";
  std::vector<std::string> rest;
};

// The rate of the recording: from the median interval, which gaps do not change.
double recorded_rate(const capture::RawLogReader& log) {
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < log.frames(); ++i) intervals.push_back(log.time_us(i) - log.time_us(i - 1));
  if (intervals.empty()) return log.header().rate_hz;
  const std::int64_t interval = upper_median(std::move(intervals));
  return interval > 0 ? 1e6 / static_cast<double>(interval) : log.header().rate_hz;
}

Result<ExitCode> replay(const GlobalOptions& options, terminal::Console& console, const ReplayOptions& wish) {
  const auto log = capture::RawLogReader::open(wish.file);
  if (!log.ok()) return log.status();
  std::string rate = wish.rate;
  if (rate == "recorded" || (rate != "max" && rate.ends_with('x'))) {
    double times = 1;
    if (rate != "recorded" && (!CLI::detail::lexical_cast(rate.substr(0, rate.size() - 1), times) || !(times > 0)))
      return {Reason::INVALID_ARGUMENT, "--rate takes recorded, max, a number of pairs a second, or 2x, 0.5x"};
    char text[32];
    std::snprintf(text, sizeof text, "%.3f", times * recorded_rate(*log));
    rate = text;
  }
  if (options.json) {
    console.reply(Json()
                      .add("file", wish.file)
                      .add("serial", log->header().serial)
                      .add("model", log->header().model)
                      .add("frames", std::uint64_t(log->frames()))
                      .add("rate_hz", recorded_rate(*log))
                      .add("torn_bytes", log->torn_bytes())
                      .text());
    return kOk;
  }
  // The front-end that was installed with this program.
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (self.parent_path() / "relmap-frontend").string();
  std::vector<std::string> words = {program, "--source", "raw", wish.file, "--rate", rate};
  words.insert(words.end(), wish.rest.begin(), wish.rest.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  return {Reason::NO_SUCH_FILE, program + ": " + std::strerror(errno)};
}

}  // namespace

void add_record(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand(
      "record", "record raw frames to a file; it stays readable whatever happens to the program or the camera");
  command->footer("Example:\n  relmap-camera record drive.raw --seconds 600");
  auto wish = std::make_shared<RecordOptions>();
  command->add_option("FILE", wish->file, "the recording; an existing file is not overwritten")
      ->type_name("FILE")
      ->required();
  command->add_option("CAMERA", wish->camera, "serial number or GUID");
  command->add_option("--seconds", wish->seconds, "record for so many seconds (default: until Ctrl-C)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--frames", wish->frames, "record so many frames");
  command
      ->add_option("--rate", wish->rate_hz,
                   "frames a second (default: that of the camera's settings, else the highest)")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--calibration", wish->calibration,
                   "calibration file or folder, instead of the one kept by serial number")
      ->type_name("FILE|FOLDER");
  command->callback([&action, wish] {
    action = [wish](const GlobalOptions& options, terminal::Console& console) {
      return record(options, console, *wish);
    };
  });
}

void add_replay(CLI::App& app, Action& action) {
  auto* const command =
      app.add_subcommand("replay", "give a recording to relmap-frontend; with --json only print what it holds");
  command->footer("Example:\n  relmap-camera replay drive.raw -- --robot cart --server /srv/map");
  auto wish = std::make_shared<ReplayOptions>();
  command->add_option("FILE", wish->file, "the recording")->type_name("FILE")->required();
  command
      ->add_option("--rate", wish->rate,
                   "recorded, max, a number of pairs a second, or a factor of the recorded rate, as 2x")
      ->capture_default_str();
  command->add_option("OPTIONS", wish->rest, "options for relmap-frontend, after --");
  command->callback([&action, wish] {
    action = [wish](const GlobalOptions& options, terminal::Console& console) {
      return replay(options, console, *wish);
    };
  });
}

}  // namespace relmap::camera
