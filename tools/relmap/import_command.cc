// relmap import: pose graphs of other programs become sessions of the map.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <ostream>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/base/json.h"
#include "tools/g2o/pose_graph.h"
#include "tools/relmap/commands.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::cli {

namespace {

constexpr double kMaxStepUs = 3.6e9;
constexpr std::int64_t kBeginUs = 946'684'800'000'000;  // 2000-01-01, since the file has no times

struct G2oOptions {
  std::string file, robot = "imported", name;
  bool robot_axes = false;
  double step_metres = 0, step_radians = 0, step_scale = 1, loop_scale = 1, speed = 1;
};

// The same file with the same numbers gives the same session, so that an interrupted import can be continued.
SessionUuid session_of(const g2o::PoseGraph& graph, const G2oOptions& options) {
  std::uint32_t crc[4] = {crc32c(as_bytes(options.name)), crc32c(as_bytes(options.robot)), 0, 0};
  const double numbers[] = {options.step_metres, options.step_radians, options.step_scale, options.loop_scale,
                            options.speed};
  crc[2] = crc32c({reinterpret_cast<const std::uint8_t*>(numbers), sizeof numbers});
  const auto add = [&](std::uint32_t& sum, const SE3& T, const Matrix6* covariance) {
    sum = crc32c({reinterpret_cast<const std::uint8_t*>(T.t.data()), sizeof(double) * 3}, sum);
    sum = crc32c({reinterpret_cast<const std::uint8_t*>(T.R.data()), sizeof(double) * 9}, sum);
    if (covariance) sum = crc32c({reinterpret_cast<const std::uint8_t*>(covariance->data()), sizeof(double) * 36}, sum);
  };
  for (const SE3& pose : graph.poses) add(crc[2], pose, nullptr);
  for (const auto* edges : {&graph.odometry, &graph.loops})
    for (const g2o::PoseGraph::Edge& edge : *edges) {
      const std::uint32_t ends[] = {edge.a, edge.b};
      crc[3] = crc32c({reinterpret_cast<const std::uint8_t*>(ends), sizeof ends}, crc[3]);
      add(crc[3], edge.T_ab, &edge.covariance);
    }
  SessionUuid uuid;
  std::memcpy(uuid.bytes.data(), crc, sizeof crc);
  return uuid;
}

Matrix6 scaled(const Matrix6& covariance, double scale) { return scale * scale * covariance; }

Matrix6 step_covariance(const g2o::PoseGraph::Edge& step, const G2oOptions& options) {
  Matrix6 covariance = scaled(step.covariance, options.step_scale);
  const auto replace = [&](int first, double sigma) {
    if (sigma <= 0) return;
    for (int i = first; i < first + 3; ++i) {
      covariance.row(i).setZero();
      covariance.col(i).setZero();
      covariance(i, i) = sigma * sigma;
    }
  };
  replace(0, options.step_metres);
  replace(3, options.step_radians);
  return covariance;
}

// All frames, each posed by the odometry alone; times follow from the distance and options.speed.
std::vector<client::GraphPiece::Frame> frames_of(const g2o::PoseGraph& graph, const G2oOptions& options) {
  std::vector<client::GraphPiece::Frame> frames;
  for (std::uint32_t i = 0; i < graph.poses.size(); ++i) {
    client::GraphPiece::Frame frame;
    frame.time_us = kBeginUs;
    if (i > 0) {
      const g2o::PoseGraph::Edge* const step = graph.step_to(i);
      const SE3 T = step ? step->T_ab : graph.poses[i - 1].inverse() * graph.poses[i];
      frame.T_odom_frame = (frames.back().T_odom_frame * T).normalized();
      if (step) frame.step_covariance = step_covariance(*step, options);
      frame.driven_us = static_cast<std::int64_t>(std::clamp(1e6 * T.t.norm() / options.speed, 1.0, kMaxStepUs));
      frame.time_us = frames.back().time_us + frame.driven_us;
    }
    frames.push_back(frame);
  }
  return frames;
}

Result<SessionNumber> send(const g2o::PoseGraph& graph, const G2oOptions& options, client::Client& client,
                           terminal::ProgressBar& bar) {
  const auto frames = frames_of(graph, options);
  std::vector<client::GraphPiece::Loop> loops;
  for (const g2o::PoseGraph::Edge& loop : graph.loops)
    loops.push_back({loop.a, loop.b, loop.T_ab.inverse(),
                     scaled(inverse_covariance(loop.T_ab, loop.covariance), options.loop_scale)});
  std::stable_sort(loops.begin(), loops.end(), [](const auto& x, const auto& y) { return x.query < y.query; });

  client::GraphPiece piece;
  piece.session = session_of(graph, options);
  piece.robot = options.robot;
  piece.name = options.name;
  Result<SessionNumber> session(SessionNumber{0});
  std::size_t next = 0;
  for (std::size_t first = 0; first < frames.size();) {
    const std::size_t count = std::min(client::GraphPiece::kMaxSent / 2, frames.size() - first);
    piece.first = static_cast<std::uint32_t>(first);
    piece.frames.assign(frames.begin() + static_cast<std::ptrdiff_t>(first),
                        frames.begin() + static_cast<std::ptrdiff_t>(first + count));
    do {
      piece.loops.clear();
      for (; next < loops.size() && loops[next].query < first + count &&
             piece.loops.size() < client::GraphPiece::kMaxSent;
           ++next)
        piece.loops.push_back(loops[next]);
      session = client.import_graph(piece);
      if (!session.ok()) return session;
    } while (next < loops.size() && loops[next].query < first + count);
    first += count;
    bar.show("import", first, frames.size(), "frames");
  }
  return session;
}

std::string listed(const std::vector<std::size_t>& lines) {
  std::string text;
  for (std::size_t i = 0; i < std::min(lines.size(), kMaxListed); ++i)
    text += (i ? ", " : "") + std::to_string(lines[i]);
  return text + (lines.size() > kMaxListed ? ", ..." : "");
}

// Tells which lines of the file are left out of the map, and why.
void tell_left_out(const g2o::PoseGraph& graph, std::ostream& err) {
  if (!graph.self_edges.empty())
    err << graph.self_edges.size() << " edges from a frame to itself are refused (INVALID_ARGUMENT): line"
        << (graph.self_edges.size() == 1 ? " " : "s ") << listed(graph.self_edges) << '\n';
  if (!graph.parallel_loops.empty())
    err << graph.parallel_loops.size() << " loops between frames that have one already are left out: line"
        << (graph.parallel_loops.size() == 1 ? " " : "s ") << listed(graph.parallel_loops) << '\n';
  std::size_t kinds = 0;
  for (const auto& [kind, lines] : graph.left_out) {
    if (++kinds > kMaxListed) break;
    err << lines << (lines == 1 ? " line of " : " lines of ") << kind << " left out: neither poses nor edges\n";
  }
  const std::size_t gaps = graph.poses.size() - 1 - graph.odometry.size();
  if (gaps > 0)
    err << gaps << " steps have no odometry: they are taken from the vertices, and the map trusts them little\n";
}

Status import_g2o(const G2oOptions& asked, client::Client& client, terminal::Console& console) {
  G2oOptions options = asked;
  for (const double number : {asked.step_metres, asked.step_radians, asked.step_scale, asked.loop_scale, asked.speed})
    if (std::isnan(number)) return {Reason::INVALID_ARGUMENT, "an option is not a number"};
  if (options.name.empty()) options.name = std::filesystem::path(options.file).filename().string();
  const auto graph =
      g2o::read_pose_graph(options.file, options.robot_axes ? g2o::PoseAxes::kRobot : g2o::PoseAxes::kCamera);
  if (!graph.ok()) return graph.status();
  if (graph->poses.empty()) return {Reason::CORRUPT, options.file + " holds no poses"};
  tell_left_out(*graph, console.err());
  console.reply(Json()
                    .add("graph", Json()
                                      .add("frames", graph->poses.size())
                                      .add("loops", graph->loops.size())
                                      .add("parallelLoops", graph->parallel_loops.size())
                                      .add("selfEdges", graph->self_edges.size()))
                    .text());

  const auto session = [&] {
    const terminal::Console::Aside aside(console);
    terminal::ProgressBar bar(console.err(), terminal::is_terminal());
    return send(*graph, options, client, bar);
  }();
  if (!session.ok()) return session.status();

  client::EdgeFilter filter;
  filter.session = *session;
  filter.kinds = {client::EdgeKind::kLoop};
  const auto edges = client.edges(filter);
  if (!edges.ok()) return edges.status();
  if (console.json) return {};
  std::map<client::EdgeState, std::size_t> states;
  std::size_t contradicted = 0;
  for (const client::Edge& edge : *edges) {
    ++states[edge.state];
    contradicted += edge.state == client::EdgeState::kCandidate && edge.reason == Reason::CONTRADICTS_MOTION;
  }
  const auto n = [](std::size_t value) { return count_text(value); };
  console.facts(
      {{"session", n(*session) + ", " + options.name},
       {"frames", n(graph->poses.size())},
       {"axes", graph->planar        ? "the plane is x-z of the frames: z ahead, x to the right, y down"
                : options.robot_axes ? "turned from the robot's: z ahead, x to the right, y down"
                                     : "as in the file, taken for a camera's: z ahead, x to the right, y down"},
       {"loops", n(graph->loops.size()) + " proposed, " + n(graph->parallel_loops.size()) +
                     " more between the same frames left out"},
       {"accepted", n(states[client::EdgeState::kAccepted])},
       {"candidates",
        n(states[client::EdgeState::kCandidate]) + ": " + n(contradicted) +
            " are contradicted by the odometry between their ends; no other loop agrees with the rest yet"},
       {"quarantined", n(states[client::EdgeState::kQuarantined]) + ": outvoted"}});
  return {};
}

}  // namespace

void add_import(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("import", "import a pose graph of another program as a session");
  command->require_subcommand(1);
  command->footer("Example:\n  relmap import g2o graph.g2o --loop-scale 2");
  auto* g2o =
      command->add_subcommand("g2o", "import a pose graph in g2o's text format: frames and edges, without pictures");
  auto options = std::make_shared<G2oOptions>();
  g2o->add_option(
         "FILE", options->file,
         "file of VERTEX_SE2 and EDGE_SE2 (a robot that looks along x, with y to its left), or of VERTEX_SE3:QUAT "
         "and EDGE_SE3:QUAT")
      ->type_name("FILE")
      ->required();
  g2o->add_option("--name", options->name, "name of the session (default: the name of the file)")->type_name("NAME");
  g2o->add_option("--robot", options->robot, "robot that the session belongs to")
      ->type_name("NAME")
      ->capture_default_str();
  g2o->add_flag("--robot-axes", options->robot_axes,
                "SE3 poses have x ahead, y left, z up (default: x right, y down, z ahead)");
  const CLI::Range positive(1e-3, 1e3), sigma(1e-9, 1e3);
  g2o->add_option("--step-metres", options->step_metres,
                  "standard deviation of an odometry step's translation, instead of the file's")
      ->check(sigma);
  g2o->add_option("--step-radians", options->step_radians,
                  "standard deviation of an odometry step's rotation, instead of the file's")
      ->check(sigma);
  g2o->add_option("--step-scale", options->step_scale, "factor for the file's standard deviations of odometry steps")
      ->check(positive)
      ->capture_default_str();
  g2o->add_option("--loop-scale", options->loop_scale, "factor for the file's standard deviations of loops")
      ->check(positive)
      ->capture_default_str();
  g2o->add_option("--speed", options->speed,
                  "speed in metres a second from which times are computed, since the file has none")
      ->check(positive)
      ->capture_default_str();
  g2o->footer(
      "The vertices become a session, in the order of their numbers. Edges between consecutive vertices are its "
      "odometry;\n"
      "all others are proposed as loop closures, and the map accepts those that agree with each other and with the\n"
      "odometry. Of several loops between the same two frames only the first is proposed.\n"
      "--json prints {\"graph\": {...}} with the counts of the file, then the loop closures.\n"
      "The same command again continues an import that was interrupted.\n\n"
      "Examples:\n"
      "  relmap import g2o parking-garage.g2o --robot-axes\n"
      "  relmap import g2o Bovisa04.g2o --step-metres 0.04 --step-radians 0.003 --loop-scale 2");
  g2o->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return import_g2o(*options, client, console);
    };
  });
}

}  // namespace relmap::cli
