// relmap report: one page about a map, for people to read, print and pass on.
#include <memory>
#include <ostream>

#include "proto/base/json.h"
#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/picture_output.h"
#include "tools/relmap/report_page.h"

namespace relmap::cli {

namespace {

Status write_report(const ReportOptions& options, client::Client& client, terminal::Console& console) {
  if (options.out != "-" && !options.out.ends_with(".html"))
    return {Reason::INVALID_ARGUMENT, "a report is a page of HTML: " + options.out + " must end with .html, or be -"};
  const auto report = gather_report(options, client, console);
  if (!report.ok()) return report.status();
  const std::string page = report_page(*report);
  if (Status status = write_output(options.out, page, console); !status.ok()) return status;
  const std::vector<std::string> findings = findings_of(*report);
  if (options.out == "-") return {};
  if (console.json) {
    Json json;
    json.add("out", options.out).add("bytes", page.size()).add("findings", findings);
    json.add("suspicious", report->suspicious_count()).add("shown", report->shown());
    if (report->laid_out) json.add("tears", report->tears.size()).add("parts", report->parts);
    json.add("monoSessions", report->mono_sessions);
    console.reply(json.text());
    return {};
  }
  for (const std::string& finding : findings) console.out() << visible_text(finding) << '\n';
  console.err() << options.out << ": " << terminal::bytes_text(page.size()) << '\n';
  return {};
}

}  // namespace

void add_report(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("report", "write one page about the map: what it holds, and what to look at");
  auto options = std::make_shared<ReportOptions>();
  command->add_option("--out", options->out, "page to write: FILE.html; - is standard output")
      ->type_name("FILE")
      ->required();
  command->add_option("--title", options->title, "title of the page")->capture_default_str();
  command
      ->add_option("--suspicious", options->suspicious,
                   "show the pictures of so many of the most suspicious closures; their number is told in any case")
      ->check(CLI::Range(0, 50))
      ->capture_default_str();
  bool* const map = &options->map;
  command->add_flag_callback(
      "--no-map", [map] { *map = false; }, "do not draw the map");
  command->footer(
      "The page is one file of HTML without scripts; its pictures are part of it. What the daemon does not tell the\n"
      "caller, as the audit log to a reader, is left out, with the reason. Prints what to look at first.\n"
      "Examples:\n"
      "  relmap report --out report.html\n"
      "  relmap report --out report.html --title 'Hall 3, week 48' --suspicious 10");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return write_report(*options, client, console);
    };
  });
}

}  // namespace relmap::cli
