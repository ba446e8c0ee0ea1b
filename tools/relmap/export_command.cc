#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <ostream>

#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

struct ExportOptions {
  std::string format = "tum", out;
  std::vector<std::string> sessions;
};

Status run_export(const ExportOptions& options, client::Client& client, Console& console) {
  std::vector<SessionNumber> sessions;
  for (const std::string& text : options.sessions) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    sessions.push_back(*session);
  }
  std::ofstream file;
  if (!options.out.empty()) {
    file.open(options.out, std::ios::binary | std::ios::trunc);
    if (!file) return {Reason::IO_ERROR, options.out + " cannot be written: " + std::strerror(errno)};
  }
  std::ostream& out = options.out.empty() ? console.out() : file;
  const bool silent = console.json && options.out.empty();  // the replies carry the bytes
  const auto format = options.format == "kitti" ? client::ExportFormat::kKitti : client::ExportFormat::kTum;
  const Status status =
      client.export_trajectories(format, sessions, [&](SessionNumber, std::string_view bytes) -> Status {
        if (!silent) out << bytes;
        if (!out) return {Reason::IO_ERROR, "the export cannot be written"};
        return {};
      });
  out.flush();
  if (status.ok() && !out) return {Reason::IO_ERROR, "the export cannot be written"};
  return status;
}

}  // namespace

void add_export(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("export", "trajectories, chained along odometry, in their first frame");
  auto options = std::make_shared<ExportOptions>();
  command->add_option("--format", options->format, "tum or kitti")
      ->check(CLI::IsMember({"tum", "kitti"}))
      ->capture_default_str();
  command->add_option("--session", options->sessions, "only these (number or name)");
  command->add_option("--out", options->out, "a file; stdout if it is not given");
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) { return run_export(*options, client, console); };
  });
}

}  // namespace relmap::cli
