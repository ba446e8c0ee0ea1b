#include "tools/relmap/report_page.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "proto/base/markup.h"
#include "proto/base/printf_text.h"
#include "proto/base/quantile.h"
#include "proto/base/suspicion.h"
#include "tools/relmap/edge_words.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kMatrixSessions = 24;  // with most closures; a larger table cannot be read
constexpr std::size_t kMaxSessionRows = 200, kMaxDays = 60, kMaxTears = 10;
constexpr std::size_t kNamedClosures = 5;  // suspicious ones, among the findings

constexpr char kStyle[] = R"(
:root{color-scheme:light dark;--ink:#26282e;--faint:#6a7078;--paper:#fcfcfa;--card:#fff;--rule:#dcdcd6;--heat:213,94,0;--bad:#c0125e}
@media(prefers-color-scheme:dark){:root{--ink:#e6e6e2;--faint:#9aa0a8;--paper:#17181b;--card:#202226;--rule:#3a3c42;--heat:240,130,40;--bad:#ff6aa8}}
body{font:15px/1.5 system-ui,"Segoe UI",Helvetica,Arial,sans-serif;color:var(--ink);background:var(--paper);max-width:1240px;margin:0 auto;padding:24px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:34px 0 8px;border-bottom:1px solid var(--rule);padding-bottom:4px}
p{margin:6px 0}.faint{color:var(--faint)}code{font:13px ui-monospace,Consolas,monospace;background:var(--card);border:1px solid var(--rule);border-radius:3px;padding:0 4px}
.tiles{display:flex;flex-wrap:wrap;gap:10px;margin:16px 0}.tile{background:var(--card);border:1px solid var(--rule);border-radius:6px;padding:8px 14px;min-width:110px}
.tile b{display:block;font-size:22px;line-height:1.25}.tile span{color:var(--faint);font-size:13px}
table{border-collapse:collapse;margin:8px 0;font-size:14px}th{text-align:left;color:var(--faint);font-weight:600}
th,td{padding:3px 12px 3px 0;border-bottom:1px solid var(--rule);vertical-align:top}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.wide{overflow-x:auto}table.heat td,table.heat th{padding:3px 7px;border:1px solid var(--rule);text-align:center}table.heat td>div{margin:-3px -7px;padding:3px 7px}table.heat .sus{outline:2px solid var(--bad);outline-offset:-2px}
figure{margin:12px 0;break-inside:avoid}figure svg{display:block;max-width:100%;height:auto;border-radius:6px;border:1px solid var(--rule)}
.look{border-left:4px solid var(--bad);background:var(--card);padding:6px 14px;margin:12px 0}.look li{margin:3px 0}
.bar{display:inline-block;height:11px;background:rgb(var(--heat));opacity:.75;vertical-align:middle;min-width:1px}
.cut{max-width:520px;overflow-wrap:anywhere}
@media print{:root{--ink:#000;--faint:#444;--paper:#fff;--card:#fff;--rule:#bbb}body{max-width:none;padding:0;font-size:11pt}h2{break-after:avoid}tr,figure{break-inside:avoid}}
)";

// HTML is built as text; whatever is not ours goes through this.
std::string shown_html(std::string_view text) { return "<bdi>" + markup_text(text) + "</bdi>"; }
std::string code_html(std::string_view text) { return "<code>" + markup_text(text) + "</code>"; }
std::string paragraph_html(const std::string& html) { return "<p>" + html + "</p>\n"; }
std::string heading_html(const char* text) { return std::string("<h2>") + text + "</h2>\n"; }
// Why something is not in the report.
std::string left_out(const Status& why) {
  return paragraph_html("<span class=\"faint\">Not told: " + shown_html(why.to_string()) + "</span>");
}
std::string reason_html(Reason reason) { return code_html(reason_name(reason)); }

// A column whose name begins with '>' is for numbers. Cells are HTML.
class Table {
 public:
  explicit Table(const std::vector<std::string>& heads, const char* kind = "") {
    html_ = std::string("<div class=\"wide\"><table") + kind + "><tr>";
    for (const std::string& head : heads) {
      number_.push_back(head.starts_with('>'));
      html_ += (number_.back() ? "<th class=\"n\">" : "<th>") + markup_text(number_.back() ? head.substr(1) : head) +
               "</th>";
    }
    html_ += "</tr>\n";
  }
  void row(const std::vector<std::string>& cells) {
    html_ += "<tr>";
    for (std::size_t i = 0; i < cells.size(); ++i)
      html_ += (i < number_.size() && number_[i] ? "<td class=\"n\">" : "<td>") + cells[i] + "</td>";
    html_ += "</tr>\n";
  }
  std::string html() const { return html_ + "</table></div>\n"; }

 private:
  std::string html_;
  std::vector<bool> number_;
};

std::string session_name(const MapReport& report, SessionNumber number) {
  for (const client::Session& session : report.sessions)
    if (session.number == number) return session.name;
  return "session " + std::to_string(number);
}

std::string tiles(const MapReport& report) {
  std::string html = "<div class=\"tiles\">";
  const auto tile = [&](const std::string& value, const char* what) {
    html += "<div class=\"tile\"><b>" + markup_text(value) + "</b><span>" + what + "</span></div>";
  };
  const client::DaemonStatus& status = report.status;
  std::set<std::string> robots;
  for (const client::Session& session : report.sessions) robots.insert(session.robot);
  tile(count_text(status.frames), "keyframes");
  tile(count_text(report.sessions.size()), "sessions");
  tile(count_text(robots.size()), "robots");
  tile(count_text(status.closures_accepted), "loop closures in force");
  tile(count_text(status.closures_candidate + status.closures_quarantined), "not in force");
  tile(count_text(status.labels), "labels");
  if (report.store_missing.ok())
    tile(terminal::bytes_text(report.store.map_bytes + report.store.journal_bytes), "on disk");
  return html + "</div>\n";
}

std::string findings(const MapReport& report) {
  const std::vector<std::string> list = findings_of(report);
  if (list.empty()) return paragraph_html("Nothing needs a look.");
  std::string html = "<div class=\"look\"><b>To look at first</b><ul>";
  for (const std::string& finding : list) html += "<li>" + shown_html(finding) + "</li>";
  return html + "</ul></div>\n";
}

std::string sessions(const MapReport& report) {
  std::string html = heading_html("Sessions");
  Table table({">no", "session", "robot", "state", ">keyframes", "began", "lasted", ">refused", ">given up"});
  std::size_t rows = 0;
  for (const client::Session& s : report.sessions) {
    if (++rows > kMaxSessionRows) break;
    table.row({std::to_string(s.number), shown_html(s.name), shown_html(s.robot), name_of(s.state),
               count_text(s.frames), time_text(s.first_time_us).substr(0, 16),
               markup_text(terminal::duration_text(static_cast<double>(s.last_time_us - s.first_time_us) * 1e-6)),
               count_text(s.refused), count_text(s.given_up)});
  }
  html += table.html();
  if (report.sessions.size() > kMaxSessionRows)
    html += paragraph_html(count_text(report.sessions.size() - kMaxSessionRows) + " more sessions are not listed.");
  return html;
}

std::string coverage(const MapReport& report) {
  if (report.keyframes_by_day.empty()) return {};
  std::uint64_t most = 0;
  for (const auto& [day, count] : report.keyframes_by_day) most = std::max(most, count);
  std::string html = heading_html("Keyframes by day (UTC)");
  Table table({"day", ">keyframes", ""});
  const std::size_t skipped = report.keyframes_by_day.size() - std::min(report.keyframes_by_day.size(), kMaxDays);
  std::size_t at = 0;
  for (const auto& [day, count] : report.keyframes_by_day)
    if (++at > skipped)
      table.row({markup_text(day), count_text(count),
                 printf_text("<span class=\"bar\" style=\"width:%.0fpx\"></span>",
                             360 * static_cast<double>(count) / static_cast<double>(most))});
  html += table.html();
  if (skipped > 0) html += paragraph_html("The last " + std::to_string(kMaxDays) + " days with keyframes are listed.");
  return html;
}

std::string map_part(const MapReport& report) {
  if (!report.map_asked) return {};
  std::string html = heading_html("The map");
  if (!report.map_missing.ok()) return html + left_out(report.map_missing);
  if (report.parts > 1)
    html += paragraph_html(count_text(report.parts) + " parts that nothing connects; each is drawn by itself.");
  html += "<figure>" + report.map_svg + "</figure>\n";
  if (!report.map_text.empty()) html += paragraph_html(markup_text(report.map_text) + ".");
  if (report.tears.empty()) {
    html += paragraph_html("No tear: relaxing the map for this picture stretches no edge by more than " +
                           fixed(client::kTearSigmas, 0) + " sigmas.");
  } else {
    html += paragraph_html(counted_text(report.tears.size(), "edge") + " had to be stretched by more than " +
                           fixed(client::kTearSigmas, 0) + " sigmas: measurements contradict each other there.");
    Table table({"edge", "from", "to", ">metres", ">degrees", ">sigmas"});
    for (std::size_t i = 0; i < std::min(report.tears.size(), kMaxTears); ++i) {
      const client::Tear& tear = report.tears[i];
      table.row({code_html(tear.name()), tear.a.to_string(), tear.b.to_string(), fixed(tear.metres, 3),
                 fixed(tear.degrees, 2), fixed(tear.sigmas, 1)});
    }
    html += table.html();
  }
  return html;
}

// The sessions with most closures, ascending.
std::vector<SessionNumber> matrix_sessions(const MapReport& report) {
  std::map<SessionNumber, std::uint64_t> closures;
  for (const client::ClosureMatrixCell& cell : report.matrix) {
    closures[cell.session_a] += cell.accepted;
    if (cell.session_b != cell.session_a) closures[cell.session_b] += cell.accepted;
  }
  std::vector<std::pair<std::uint64_t, SessionNumber>> most;
  for (const auto& [session, count] : closures) most.emplace_back(count, session);
  std::sort(most.rbegin(), most.rend());
  if (most.size() > kMatrixSessions) most.resize(kMatrixSessions);
  std::vector<SessionNumber> chosen;
  for (const auto& [count, session] : most) chosen.push_back(session);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::string matrix(const MapReport& report) {
  if (!report.matrix_missing.ok()) return left_out(report.matrix_missing);
  if (report.matrix.empty()) return paragraph_html("There is no loop closure.");
  std::map<std::pair<SessionNumber, SessionNumber>, const client::ClosureMatrixCell*> cells;
  std::uint32_t most = 1;
  for (const client::ClosureMatrixCell& cell : report.matrix) {
    cells[{cell.session_a, cell.session_b}] = cells[{cell.session_b, cell.session_a}] = &cell;
    most = std::max(most, cell.accepted);
  }
  const std::vector<SessionNumber> chosen = matrix_sessions(report);
  std::vector<std::string> heads{"", "session"};
  for (const SessionNumber session : chosen) heads.push_back(std::to_string(session));
  Table table(heads, " class=\"heat\"");
  for (const SessionNumber row : chosen) {
    std::vector<std::string> line{std::to_string(row), shown_html(session_name(report, row))};
    for (const SessionNumber column : chosen) {
      const auto found = cells.find({row, column});
      if (found == cells.end()) {
        line.emplace_back("<span class=\"faint\">&middot;</span>");
        continue;
      }
      const client::ClosureMatrixCell& cell = *found->second;
      const double heat = std::log1p(cell.accepted) / std::log1p(most);
      // Doubtful pairs are outlined, so that they are seen without colours, too.
      line.push_back(
          printf_text("<div%s style=\"background:rgba(var(--heat),%.2f)\" title=\"%u in force, %u candidates, "
                      "%u quarantined, %u removed; largest suspicion %.2f\">%u</div>",
                      cell.suspicion >= kSuspicious ? " class=\"sus\"" : "", 0.6 * heat, cell.accepted, cell.candidate,
                      cell.quarantined, cell.removed, cell.suspicion, cell.accepted));
    }
    table.row(line);
  }
  std::string html =
      paragraph_html("Loop closures in force between each two sessions; outlined: one of them has a suspicion of " +
                     fixed(kSuspicious, 1) + " or more.") +
      table.html();
  return html;
}

// Those whose pictures were asked for.
std::size_t to_be_shown(const MapReport& report) {
  return static_cast<std::size_t>(std::count_if(
      report.suspicious.begin(), report.suspicious.end(),
      [](const MapReport::Suspicious& closure) { return !closure.svg.empty() || !closure.not_shown.ok(); }));
}

// "12 of those in force have"
std::string suspicious_text(const MapReport& report) {
  const std::size_t count = report.suspicious_count();
  return count_text(count) + (count >= MapReport::kMaxSuspicious ? " or more" : "") + " of those in force " +
         (count == 1 ? "has" : "have");
}

std::string loops(const MapReport& report) {
  const client::DaemonStatus& status = report.status;
  std::string html = heading_html("Loop closures");
  html += paragraph_html(count_text(status.closures_accepted) + " in force, " + count_text(status.closures_candidate) +
                         " candidates, " + count_text(status.closures_quarantined) + " quarantined, " +
                         count_text(status.closures_removed) + " removed.");
  html += matrix(report);
  if (!report.suspicious_missing.ok()) return html + left_out(report.suspicious_missing);
  const std::size_t suspicious = report.suspicious_count(), to_show = to_be_shown(report);
  html += paragraph_html(suspicious == 0
                             ? "None of those in force has a suspicion of " + fixed(kSuspicious, 1) + " or more."
                             : suspicious_text(report) + " a suspicion of " + fixed(kSuspicious, 1) + " or more; " +
                                   code_html("relmap edges --suspicion") + " lists the most suspicious first.");
  if (to_show == 0) return html;
  html += paragraph_html(
      "<b>The most suspicious of those in force.</b> A wrong one shows in its pictures: lines that cross, "
      "or join things that are not the same. " +
      code_html("relmap edge remove ID --dry-run") + " tells what its removal would change.");
  for (const MapReport::Suspicious& closure : report.suspicious) {
    if (!closure.svg.empty()) html += "<figure>" + closure.svg + "</figure>\n";
    if (!closure.not_shown.ok())
      html += paragraph_html(
          "The pictures of " + code_html(closure.edge.id.to_string()) +
          (closure.edge.suspicion ? ", whose suspicion is " + fixed(closure.edge.suspicion->value, 2) + "," : "") +
          " cannot be shown: " + shown_html(closure.not_shown.to_string()));
  }
  return html;
}

std::string errors(const MapReport& report) {
  if (report.errors.empty() && report.sigmas.empty()) return {};
  std::string html = heading_html("Error");
  if (!report.errors.empty()) {
    std::size_t sampled = 0;
    for (const MapReport::SessionErrors& session : report.errors) sampled += session.pixels.size();
    html += paragraph_html("Mean reprojection error of " + counted_text(sampled, "keyframe") + ", chosen evenly:");
    Table table({"session", ">keyframes", ">median, px", ">largest, px"});
    for (const MapReport::SessionErrors& session : report.errors)
      table.row({shown_html(session_name(report, session.session)), count_text(session.pixels.size()),
                 fixed(quantile(session.pixels, 0.5), 2), fixed(session.pixels.back(), 2)});
    html += table.html();
  }
  if (!report.sigmas.empty())
    html += paragraph_html("Position relative to " + report.sigmas_root.to_string() +
                           ", along the most certain path: one sigma is at most " +
                           number_text(report.sigmas.back().value) + " m, of half of the keyframes at most " +
                           number_text(weighted_quantile(report.sigmas, 0.5)) + " m.");
  return html;
}

std::string counts_table(const client::ReasonCounts& counts) {
  Table table({"reason", ">keyframes", "what it means, and what to do"});
  std::vector<std::pair<std::uint64_t, Reason>> sorted;
  for (const auto& [reason, count] : counts) sorted.emplace_back(count, reason);
  std::sort(sorted.rbegin(), sorted.rend());
  for (const auto& [count, reason] : sorted)
    table.row({reason_html(reason), count_text(count),
               code_html("relmap-admin explain " + std::string(reason_name(reason)))});
  return table.html();
}

std::string refusals(const MapReport& report) {
  const client::DaemonStatus& status = report.status;
  std::string html = heading_html("Refusals and gaps");
  if (status.refused_by_reason.empty() && status.not_taken.empty() && status.gaps == 0)
    return html + paragraph_html("No keyframe was refused, and no gap was declared.");
  if (!status.refused_by_reason.empty())
    html += paragraph_html("Refused for good, since the map began:") + counts_table(status.refused_by_reason);
  if (!status.not_taken.empty())
    html += paragraph_html("Not taken, since the daemon started; robots send these again:") +
            counts_table(status.not_taken);
  if (status.gaps > 0)
    html += paragraph_html(counted_text(status.gaps, "keyframe") +
                           " was given up by robots, and bridged. What lies in between is a guess.");
  return html;
}

std::string robots(const MapReport& report) {
  std::string html = heading_html("Robots");
  if (!report.robots_missing.ok()) return html + left_out(report.robots_missing);
  if (report.robots.empty()) return html + paragraph_html("No robot has sent anything in the last minutes.");
  Table table({"robot", "session", ">keyframes/s", ">silent for", ">missing", ">waiting", "blocked"});
  for (const client::RobotStatus& robot : report.robots)
    table.row({shown_html(robot.robot.empty() ? robot.uuid : robot.robot), shown_html(robot.name),
               fixed(robot.keyframes_per_s, 1), markup_text(terminal::duration_text(robot.silent_s)),
               count_text(robot.missing), count_text(robot.pending),
               robot.blocked == Reason::OK ? "" : reason_html(robot.blocked)});
  return html + table.html();
}

std::string storage(const MapReport& report) {
  std::string html = heading_html("Storage and memory");
  Table table({"what", ">size"});
  if (report.store_missing.ok()) {
    table.row({"map", markup_text(terminal::bytes_text(report.store.map_bytes))});
    table.row({"of which <code>relmap-admin compact</code> frees",
               markup_text(terminal::bytes_text(report.store.garbage_bytes))});
    table.row({"journal, " + count_text(report.store.journal_records) + " records",
               markup_text(terminal::bytes_text(report.store.journal_bytes))});
  }
  table.row({"memory used of the budget of " + markup_text(terminal::bytes_text(report.status.memory_budget)),
             markup_text(terminal::bytes_text(report.status.memory_used))});
  table.row({"memory of the process", markup_text(terminal::bytes_text(report.status.resident_bytes))});
  html += table.html();
  return report.store_missing.ok() ? html : html + left_out(report.store_missing);
}

std::string audit(const MapReport& report) {
  std::string html = heading_html("Who edited what");
  if (!report.audit_missing.ok()) return html + left_out(report.audit_missing);
  if (report.audit.entries.empty()) return html + paragraph_html("Nobody has edited anything that is on record.");
  Table table({"when", "who", "role", "what", "request", "outcome"});
  for (const client::AuditEntry& entry : report.audit.entries)
    table.row({time_text(entry.time_us).substr(0, 19), shown_html(entry.who.empty() ? "(not known)" : entry.who),
               shown_html(entry.role), code_html(entry.method),
               "<div class=\"cut\">" + shown_html(std::string_view(entry.request).substr(0, 200)) + "</div>",
               entry.outcome.ok() ? "done" : reason_html(entry.outcome.reason())});
  html += table.html();
  if (report.audit.unreadable > 0)
    html += paragraph_html(counted_text(report.audit.unreadable, "line") + " of the audit log cannot be read.");
  return html;
}

}  // namespace

std::vector<std::string> findings_of(const MapReport& report) {
  std::vector<std::string> list;
  const client::DaemonStatus& status = report.status;
  for (const Status& trouble : {status.storage, status.lcm, status.connections, status.access, status.certificate})
    if (!trouble.ok()) list.push_back(trouble.to_string());
  for (const client::DoubtfulCamera& camera : status.doubtful_cameras)
    list.push_back("The calibration of session " + std::to_string(camera.session) + " (" + camera.name +
                   ") contradicts that of others: " + camera.message);
  const std::size_t suspicious = report.suspicious_count();
  for (std::size_t i = 0; i < std::min(suspicious, kNamedClosures); ++i) {
    const MapReport::Suspicious& closure = report.suspicious[i];
    const std::string id = closure.edge.id.to_string();
    list.push_back(
        "Loop closure " + id + " is suspicious (" + fixed(closure.edge.suspicion->value, 2) + " of 1)" +
        (closure.edge.suspicion->doubts.empty()
             ? ""
             : ": " + std::string(name_of(closure.edge.suspicion->doubts.front().kind))) +
        (closure.svg.empty() ? ". \"relmap edges --explain " + id + "\" says why." : ". Look at its pictures below."));
  }
  if (suspicious > kNamedClosures)
    list.push_back("Of the loop closures, " + suspicious_text(report) + " a suspicion of " + fixed(kSuspicious, 1) +
                   " or more.");
  if (!report.tears.empty())
    list.push_back("Measurements contradict each other: " + report.tears.front().words() + "." +
                   (report.tears.size() > 1 ? " " + counted_text(report.tears.size(), "tear") + " in all." : ""));
  if (status.refused > 0)
    list.push_back(counted_text(status.refused, "keyframe") + (status.refused == 1 ? " was" : " were") +
                   " refused for good.");
  if (report.parts > 1) list.push_back("The map has " + std::to_string(report.parts) + " parts that nothing connects.");
  for (const client::RobotStatus& robot : report.robots) {
    if (robot.blocked != Reason::OK)
      list.push_back("Robot " + robot.robot + " is held up: " + std::string(reason_name(robot.blocked)) + ".");
    if (robot.silent) list.push_back("Robot " + robot.robot + " fell silent without having ended its session.");
  }
  return list;
}

std::string report_page(const MapReport& report) {
  const client::DaemonStatus& status = report.status;
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      // Whatever a name may hold, nothing runs and nothing is fetched.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; img-src "
      "data:\">\n<title>" +
      markup_text(report.title) + "</title><style>" + kStyle + "</style></head><body>\n";
  html += "<h1>" + shown_html(report.title) + "</h1>\n";
  html += "<p class=\"faint\">" + shown_html(status.data_folder) + ", " +
          markup_text(time_text(report.made_us).substr(0, 16)) + " UTC, relmapd " + shown_html(status.version) +
          ", up " + markup_text(terminal::duration_text(static_cast<double>(status.uptime_us) * 1e-6)) + "</p>\n";
  html += tiles(report) + findings(report) + map_part(report) + loops(report) + sessions(report) + coverage(report) +
          errors(report) + refusals(report) + robots(report) + storage(report) + audit(report);
  return html + "</body></html>\n";
}

}  // namespace relmap::cli
