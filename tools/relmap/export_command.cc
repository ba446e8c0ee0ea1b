// relmap export: writes the relaxed graph, or the chain of each session's odometry edges, as files for other programs.
#include <algorithm>
#include <memory>
#include <optional>
#include <ostream>

#include "proto/base/json.h"
#include "proto/base/number_text.h"
#include "tools/relmap/chosen_sessions.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/graph_files.h"
#include "tools/relmap/output_files.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kMaxTold = 10;  // tears and doubtful steps of a part that stderr lists
// In pixels. A landmark with less disparity in its base frame may be anywhere beyond that distance.
constexpr double kMinDisparity = 1;

struct ExportOptions {
  std::string format = "tum", out, root;
  std::vector<std::string> sessions;
  bool chain = false, landmarks = true;
  Geodetic place;
  bool placed = false;
};

// Reports what was written: as text on stderr, or as JSON on stdout (on stderr if stdout has the export itself).
class Report {
 public:
  Report(const ExportOptions& options, const OutputFiles& files, terminal::Console& console)
      : json_(console.json), out_(files.is_standard_output() ? console.err() : console.out()), err_(console.err()) {
    whole_.add("format", options.format);
  }

  struct Part {
    std::string file, root, title;   // "part 1 of 3: 195 frames in the frame of 1:0"
    std::vector<std::string> notes;  // what the file itself does not say
    std::vector<client::Tear> tears;
    std::vector<DoubtfulStep> doubtful;
    std::size_t frames = 0;
    std::uint64_t landmarks = 0;
    bool has_landmarks = false;
  };
  void add(const Part& part) {
    if (json_) return add_json(part);
    err_ << part.file << ": " << part.title << "; " << counted_text(part.tears.size(), "tear") << ", "
         << counted_text(part.doubtful.size(), "step") << " not measured or carried";
    if (part.has_landmarks) err_ << "; " << counted_text(part.landmarks, "landmark");
    err_ << '\n';
    for (const std::string& note : part.notes) err_ << "  " << note << '\n';
    tell(part.tears, "tear ");
    tell(part.doubtful, "");
  }
  void tell_relaxed(const RelaxedMap& map) {
    relaxed_frames_ = map.graph.frames.size();
    converged_ = map.converged;
    if (!converged_) advise(client::kNotConverged);
  }
  void leave_out(const std::string& root, std::size_t frames, const std::string& title) {
    if (json_)
      left_out_.push_back(Json().add("root", root).add("frames", frames));
    else
      err_ << "left out: " << title << '\n';
  }
  void advise(const std::string& text) {
    if (!json_) err_ << text << '\n';
  }
  void finish(const OutputFiles& files) {
    const std::vector<std::string> stale = files.left_behind();
    for (const std::string& file : stale)
      advise(file + " was written by an earlier export and is no part of this one.");
    if (!stale.empty()) whole_.add("stale", stale);
    whole_.add("files", files_).add("leftOut", left_out_);
    if (relaxed_frames_) whole_.add("relaxedFrames", *relaxed_frames_).add("converged", converged_);
    if (json_) out_ << whole_.text() << '\n';
  }

 private:
  static std::string line_of(const client::Tear& tear) { return tear.words(); }
  static std::string line_of(const DoubtfulStep& step) {
    return (step.carried_by.empty() ? "not measured: " : "carried: ") + step.words();
  }
  template <typename Item>
  void tell(const std::vector<Item>& items, const char* prefix) {
    for (std::size_t i = 0; i < std::min(items.size(), kMaxTold); ++i)
      err_ << "  " << prefix << line_of(items[i]) << '\n';
    if (items.size() > kMaxTold) err_ << "  and " << items.size() - kMaxTold << " more (--json has all)\n";
  }
  void add_json(const Part& part) {
    std::vector<Json> tears, doubtful;
    for (const client::Tear& tear : part.tears)
      tears.push_back(Json()
                          .add("edge", tear.edge.to_string())
                          .add("from", tear.a.to_string())
                          .add("to", tear.b.to_string())
                          .add("metres", tear.metres)
                          .add("degrees", tear.degrees)
                          .add("sigmas", tear.sigmas));
    for (const DoubtfulStep& step : part.doubtful) {
      Json json;
      json.add("edge", step.edge.to_string()).add("from", step.a.to_string()).add("to", step.b.to_string());
      if (step.carried_by.empty())
        json.add("guess", step.guess).add("sigma", step.sigma_m);
      else
        json.add("carriedBy", step.carried_by.front().to_string());
      doubtful.push_back(json.add("beside", name_of(step.beside)));
    }
    Json json;
    json.add("file", part.file).add("root", part.root).add("frames", part.frames);
    if (part.has_landmarks) json.add("landmarks", part.landmarks);
    files_.push_back(json.add("tears", tears).add("doubtful", doubtful));
  }

  const bool json_;
  std::ostream& out_;
  std::ostream& err_;
  Json whole_;
  std::vector<Json> files_, left_out_;
  std::optional<std::size_t> relaxed_frames_;  // nullopt if nothing was relaxed
  bool converged_ = true;
};

std::string title_of(const RelaxedMap& map, std::size_t number) {
  const MapPart& part = map.parts[number];
  const std::size_t sessions = part.sessions().size();
  return (map.parts.size() == 1
              ? std::string()
              : "part " + std::to_string(number + 1) + " of " + std::to_string(map.parts.size()) + ": ") +
         counted_text(part.frames.size(), "frame") + " of " + counted_text(sessions, "session") + " in the frame of " +
         part.root.to_string() + " (" + map.name(part.root.session) + ")";
}

// The landmarks of every part that is written, as lines of a PLY file.
struct Landmarks {
  std::vector<Spool> lines;
  std::vector<std::uint64_t> counts, too_far;
};
Result<Landmarks> place_landmarks(const RelaxedMap& map, std::size_t parts, const OutputFiles& files,
                                  client::Client& client) {
  Landmarks landmarks;
  landmarks.counts.resize(parts);
  landmarks.too_far.resize(parts);
  std::unordered_map<FrameId, std::size_t> part_of;
  for (std::size_t i = 0; i < parts; ++i) {
    landmarks.lines.emplace_back(files.takes_one() ? std::string() : files.name(""));
    for (const PlacedFrame& placed : map.parts[i].frames) part_of.emplace(placed.frame, i);
  }
  const auto take = [&](const client::ExportedFrame& frame) -> Status {
    const auto part = part_of.find(frame.id);  // absent: the frame came after the graph was read
    if (part == part_of.end() || frame.landmarks.empty()) return {};
    const SE3& T_root_frame = *map.parts[part->second].find(frame.id);
    const StereoCamera& camera = map.graph.cameras.at(frame.id.session);
    const double farthest = camera.f * camera.baseline / kMinDisparity;
    std::string lines;
    for (const client::ExportedFrame::Landmark& landmark : frame.landmarks) {
      const bool near = static_cast<double>(landmark.point.z()) <= farthest;
      ++(near ? landmarks.counts : landmarks.too_far)[part->second];
      if (near) lines += ply_landmark(frame.id, T_root_frame, landmark);
    }
    return landmarks.lines[part->second].append(lines);
  };
  if (Status status = client.export_frames(map.graph.sessions(), true, take); !status.ok()) return status;
  return landmarks;
}

Result<FrameTimes> read_times(const RelaxedMap& map, client::Client& client) {
  FrameTimes times;
  const Status status =
      client.export_frames(map.graph.sessions(), false, [&](const client::ExportedFrame& frame) -> Status {
        times.emplace(frame.id, frame.time_us);
        return {};
      });
  if (!status.ok()) return status;
  return times;
}

Status write_relaxed(const ExportOptions& options, client::Client& client, terminal::Console& console,
                     OutputFiles& files) {
  const terminal::Console::Aside aside(console);
  std::optional<FrameId> root;
  if (!options.root.empty()) {
    const auto frame = parse_frame(options.root);
    if (!frame.ok()) return frame.status();
    root = *frame;
  }
  auto begun = files.begin("");  // so that a file that cannot be written fails early
  if (!begun.ok()) return begun.status();
  auto graph = read_map_graph(options.sessions, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return nothing_to_place(graph->mono_sessions, "export", "exported");
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  const auto map = relax_map(std::move(graph).value(), *labels, root);
  if (!map.ok()) return map.status();

  const std::size_t written = files.takes_one() ? 1 : map->parts.size();
  FrameTimes times;
  if (options.format == "tum") {
    auto read = read_times(*map, client);
    if (!read.ok()) return read.status();
    times = std::move(read).value();
  }
  Landmarks landmarks;
  const bool with_landmarks = options.format == "ply" && options.landmarks;
  if (with_landmarks) {
    auto placed = place_landmarks(*map, written, files, client);
    if (!placed.ok()) return placed.status();
    landmarks = std::move(placed).value();
  }

  Report report(options, files, console);
  report.tell_relaxed(*map);
  for (std::size_t i = 0; i < map->parts.size(); ++i) {
    const MapPart& part = map->parts[i];
    if (i >= written) {
      report.leave_out(part.root.to_string(), part.frames.size(), title_of(*map, i));
      continue;
    }
    const std::string suffix = i == 0 ? "" : part_suffix(part.root);
    if (i > 0) begun = files.begin(suffix);
    if (!begun.ok()) return begun.status();
    std::ostream& out = **begun;
    Report::Part told{files.name(suffix), part.root.to_string(), title_of(*map, i), {},
                      part.tears,         part.doubtful,         part.frames.size()};
    if (options.format == "tum") {
      if (const std::size_t gone = write_tum(*map, i, times, out); gone > 0)
        told.notes.push_back(counted_text(gone, "frame") + " left out: deleted from the map meanwhile");
    } else if (options.format == "kitti") {
      write_kitti(part, out);
      for (const std::string& run : numbering(part, 1)) told.notes.push_back("lines " + run);
    } else if (options.format == "g2o") {
      write_g2o(*map, i, out);
    } else if (options.format == "ply") {
      told.has_landmarks = with_landmarks;
      told.landmarks = with_landmarks ? landmarks.counts[i] : 0;
      if (with_landmarks && landmarks.too_far[i] > 0)
        told.notes.push_back(count_text(landmarks.too_far[i]) +
                             " landmarks left out, since less than a pixel of disparity does not tell where they are");
      write_ply_head(*map, i, told.landmarks, out);
      if (with_landmarks)
        if (Status status = landmarks.lines[i].copy_to(out); !status.ok()) return status;
      write_ply_tail(*map, i, out);
    } else {
      // The geodetic place is that of the first part's root.
      const bool located = options.placed && i == 0;
      write_geojson(*map, i, located ? std::optional(options.place) : std::nullopt, out);
      if (!located)
        told.notes.push_back(
            "no coordinates on the Earth are known, so features have metresInRoot instead of a geometry");
    }
    report.add(told);
  }
  if (map->graph.mono_sessions > 0) report.advise(not_placed_text(map->graph.mono_sessions, "exported"));
  if (map->parts.size() > 1) {
    report.advise("The parts are not connected: how they lie to each other is not known.");
    if (written == 1) report.advise("--out FILE writes each part to a file of its own; --root FRAME chooses one.");
  }
  const Status status = files.finish();
  if (status.ok()) report.finish(files);
  return status;
}

Status write_chains(const ExportOptions& options, client::Client& client, terminal::Console& console,
                    OutputFiles& files) {
  std::vector<SessionNumber> chosen;
  for (const std::string& text : options.sessions) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    chosen.push_back(*session);
  }
  std::vector<client::Session> sessions;
  std::size_t mono_sessions = 0;
  {
    const terminal::Console::Aside aside(console);
    auto all = client.sessions();
    if (!all.ok()) return all.status();
    for (const client::Session& session : *all)
      if (chosen.empty() && session.frames > 0 && !session.camera.is_stereo()) ++mono_sessions;
    for (client::Session& session : *all)
      if (session.frames > 0 &&
          (chosen.empty() ? session.camera.is_stereo()
                          : std::find(chosen.begin(), chosen.end(), session.number) != chosen.end()))
        sessions.push_back(std::move(session));
  }
  std::stable_sort(sessions.begin(), sessions.end(), [](const auto& x, const auto& y) { return x.frames > y.frames; });
  const bool replies = console.json && files.is_standard_output();  // the replies carry the bytes and their sessions
  if (files.takes_one() && !replies && sessions.size() > 1) chosen = {sessions[0].number};
  const auto format = options.format == "kitti" ? client::ExportFormat::kKitti : client::ExportFormat::kTum;
  std::map<SessionNumber, Report::Part> parts;
  std::ostream* out = nullptr;
  SessionNumber begun = 0;
  Status status = client.export_trajectories(format, chosen, [&](const client::TrajectoryPiece& piece) -> Status {
    const auto found = std::find_if(sessions.begin(), sessions.end(),
                                    [&](const client::Session& session) { return session.number == piece.session; });
    if (found == sessions.end()) return {};  // the session began after the sessions were listed
    Report::Part& part = parts[piece.session];
    if (begun != piece.session) {
      begun = piece.session;
      const FrameId first{found->number, found->first};
      const std::string suffix = found == sessions.begin() ? "" : part_suffix(first);
      const auto stream = files.begin(suffix);
      if (!stream.ok()) return stream.status();
      out = *stream;
      part.file = files.name(suffix);
      part.root = first.to_string();
      part.frames = found->frames;
      part.title = "chained odometry edges of session " + std::to_string(found->number) + " (" + found->name +
                   "): " + counted_text(found->frames, "frame") + " in the frame of " + part.root;
    }
    for (const client::Edge& edge : piece.doubtful) part.doubtful.push_back(doubtful_step(edge));
    if (!replies) *out << piece.bytes;
    return *out ? Status() : Status(Reason::IO_ERROR, "the export cannot be written");
  });
  if (status.ok()) status = files.finish();
  if (!status.ok() || replies) return status;
  Report report(options, files, console);
  for (const client::Session& session : sessions) {
    const auto part = parts.find(session.number);
    if (part != parts.end())
      report.add(part->second);
    else
      report.leave_out(FrameId{session.number, session.first}.to_string(), session.frames,
                       "session " + std::to_string(session.number) + " (" + session.name + "), " +
                           counted_text(session.frames, "frame"));
  }
  if (mono_sessions > 0) report.advise(not_placed_text(mono_sessions, "exported"));
  if (sessions.size() > parts.size())
    report.advise("--out FILE writes each session to a file of its own; --session NAME chooses one.");
  report.finish(files);
  return {};
}

}  // namespace

void add_export(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("export", "write the map's relaxed graph, or each session's chained odometry edges, to files");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("--format", options->format, "format of the files: tum, kitti, g2o, ply or geojson")
      ->check(CLI::IsMember({"tum", "kitti", "g2o", "ply", "geojson"}))
      ->capture_default_str();
  command->add_option("--session", options->sessions, "export only these sessions (number or name)")
      ->type_name("SESSION");
  command
      ->add_option("--out", options->out,
                   "file to write (default, and -: stdout); further parts get names of their own beside it")
      ->type_name("FILE");
  auto* root = command
                   ->add_option("--root", options->root,
                                "a frame, as 3:120: its part comes first, in the coordinates of this frame")
                   ->type_name("FRAME");
  auto* chain =
      command->add_flag("--chain", options->chain,
                        "for tum and kitti: write each session's odometry edges, as the map has refined them, chained "
                        "from its first frame; the chain does not close loops");
  chain->excludes(root);
  command->add_flag("!--no-landmarks", options->landmarks, "ply: write frames and edges only");
  auto* latitude = command->add_option("--latitude", options->place.latitude, "geojson: latitude of the root, degrees")
                       ->check(CLI::Range(-85.0, 85.0));
  auto* longitude =
      command->add_option("--longitude", options->place.longitude, "geojson: longitude of the root, degrees")
          ->check(CLI::Range(-180.0, 180.0));
  auto* heading = command->add_option("--heading", options->place.heading,
                                      "geojson: direction in which the root looks, degrees from north towards east");
  command
      ->add_option("--altitude", options->place.altitude, "geojson: altitude of the root, metres above the ellipsoid")
      ->needs(latitude);
  latitude->needs(longitude, heading);
  longitude->needs(latitude, heading);
  heading->needs(latitude, longitude);
  command->footer(
      "Examples:\n"
      "  relmap export --out map.tum                               # the largest part; others: map.2-0.tum ...\n"
      "  relmap export --session morning --root 1:20 --out morning.tum\n"
      "  relmap export --format kitti --chain --session 1 > chain.txt\n"
      "  relmap export --format ply --out map.ply                  # frames and landmarks\n"
      "  relmap export --format geojson --latitude 51.508 --longitude -0.128 --heading 90 --out map.geojson\n"
      "The graph is relaxed: all poses of a connected part are given in the frame of its root. Parts that are not\n"
      "connected go into files of their own, named by their roots; stdout takes one part only. Files and stderr list\n"
      "tears (edges that the relaxed poses contradict by more than 6 sigmas), steps that nothing measured, and "
      "stretches\n"
      "in which the robot was carried. A kitti file has no room for comments, so these are on stderr only. The map "
      "does\n"
      "not know where it lies on the Earth: geojson has coordinates only if --latitude, --longitude and --heading of "
      "the\n"
      "root are given, else metres in the root's frame as properties.\n"
      "The robot's own odometry, as it was sent, is not exported; relmap frame shows it.");
  command->callback([&action, options, latitude] {
    const bool trajectory = options->format == "tum" || options->format == "kitti";
    if (options->chain && !trajectory)
      throw CLI::ValidationError("--chain",
                                 "is for tum and kitti; " + options->format + " is always the relaxed graph");
    if (latitude->count() > 0 && options->format != "geojson")
      throw CLI::ValidationError("--latitude", "is for geojson; " + options->format + " is in the frame of its root");
    options->placed = latitude->count() > 0;
    action = [options](client::Client& client, terminal::Console& console) {
      OutputFiles files(options->out, console.out());
      return options->chain ? write_chains(*options, client, console, files)
                            : write_relaxed(*options, client, console, files);
    };
  });
}

}  // namespace relmap::cli
