#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <ostream>

#include "tools/relmap/commands.h"
#include "tools/relmap/graph_files.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct ExportOptions {
  std::string format = "tum", out;
  std::vector<std::string> sessions;
  Geodetic root;
};

Status write_trajectories(const ExportOptions& options, client::Client& client, Console& console, std::ostream& out) {
  std::vector<SessionNumber> sessions;
  for (const std::string& text : options.sessions) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    sessions.push_back(*session);
  }
  const bool silent = console.json && options.out.empty();  // the replies carry the bytes
  const auto format = options.format == "kitti" ? client::ExportFormat::kKitti : client::ExportFormat::kTum;
  return client.export_trajectories(format, sessions, [&](SessionNumber, std::string_view bytes) -> Status {
    if (!silent) out << bytes;
    if (!out) return {Reason::IO_ERROR, "the export cannot be written"};
    return {};
  });
}

Status write_graph(const ExportOptions& options, client::Client& client, Console& console, std::ostream& out) {
  const Console::Aside aside(console);
  auto graph = read_map_graph(options.sessions, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return {Reason::EMPTY_MAP, "there is nothing to export"};
  auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  const auto map = relax_map(std::move(graph).value(), std::move(labels).value());
  if (!map.ok()) return map.status();
  out << (options.format == "g2o"   ? to_g2o(*map)
          : options.format == "ply" ? to_ply(*map)
                                    : to_geojson(*map, options.root));
  console.err() << map->relaxation.poses.size() << " frames in the frame of " << map->roots().front().to_string();
  if (map->relaxation.components > 1)
    console.err() << " and, unconnected, of " << map->relaxation.components - 1 << " more";
  console.err() << "; " << map->tears.size() << " tears\n";
  return {};
}

Status run_export(const ExportOptions& options, client::Client& client, Console& console) {
  // What was there stays until all is written; a device or a pipe is written as it comes.
  std::error_code ignored;
  const bool in_place = options.out.empty() || (std::filesystem::exists(options.out, ignored) &&
                                                !std::filesystem::is_regular_file(options.out, ignored));
  const std::string path = options.out + (in_place ? "" : ".partial");
  std::ofstream file;
  if (!options.out.empty()) {
    file.open(path, std::ios::binary | std::ios::trunc);
    if (!file) return {Reason::IO_ERROR, path + " cannot be written: " + std::strerror(errno)};
  }
  std::ostream& out = options.out.empty() ? console.out() : file;
  const bool trajectories = options.format == "tum" || options.format == "kitti";
  Status status =
      trajectories ? write_trajectories(options, client, console, out) : write_graph(options, client, console, out);
  out.flush();
  if (status.ok() && !out) status = {Reason::IO_ERROR, "the export cannot be written"};
  if (in_place) return status;
  file.close();
  std::error_code error;
  if (status.ok()) std::filesystem::rename(path, options.out, error);
  if (error) status = {Reason::IO_ERROR, options.out + " cannot be written: " + error.message()};
  if (!status.ok()) std::filesystem::remove(path, ignored);
  return status;
}

}  // namespace

void add_export(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("export", "trajectories, or the graph relaxed into one frame, as files");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("--format", options->format, "tum, kitti, g2o, ply or geojson")
      ->check(CLI::IsMember({"tum", "kitti", "g2o", "ply", "geojson"}))
      ->capture_default_str();
  command->add_option("--session", options->sessions, "only these (number or name)");
  command->add_option("--out", options->out, "a file; stdout if it is not given");
  auto* latitude = command->add_option("--latitude", options->root.latitude, "geojson: of the root, degrees")
                       ->check(CLI::Range(-85.0, 85.0));
  auto* longitude = command->add_option("--longitude", options->root.longitude, "geojson: likewise")
                        ->check(CLI::Range(-180.0, 180.0))
                        ->needs(latitude);
  latitude->needs(longitude);
  command->add_option("--heading", options->root.heading, "geojson: where the root looks, degrees from north to east");
  command->footer(
      "Examples:\n"
      "  relmap export --format tum --session morning --out morning.txt\n"
      "  relmap export --format g2o --out map.g2o\n"
      "  relmap export --format geojson --latitude 51.508 --longitude -0.128 --heading 90 --out map.geojson\n"
      "tum, kitti: each session chained along its odometry, in its first frame. g2o, ply, geojson: the graph relaxed; "
      "each\n"
      "file names its root frames, and its tears, edges that the relaxed poses are more than 6 sigmas off. Of a map\n"
      "without a place on the Earth geojson lies at latitude 0, longitude 0: true to scale.");
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) { return run_export(*options, client, console); };
  });
}

}  // namespace relmap::cli
