#include "tools/batch/batch_report.h"

#include <algorithm>
#include <map>
#include <ostream>

#include "proto/base/json.h"
#include "proto/base/number_text.h"

namespace relmap::batch {

namespace {

const char* state_of(const Task& task) {
  switch (task.stage) {
    case Stage::kWaiting:
      return task.starts > 0 ? "interrupted" : "not begun";
    case Stage::kRunning:
      return "running";
    case Stage::kDone:
      return "done";
    case Stage::kWasThere:
      return "was there";
    case Stage::kFailed:
      return "failed";
  }
  return "";
}

std::string counts_text(const std::map<std::string, std::uint64_t>& counts) {
  std::string text;
  for (const auto& [reason, n] : counts) text += (text.empty() ? "" : ", ") + std::to_string(n) + ' ' + reason;
  return text;
}

// The keyframes and pictures that were lost, by reason.
std::string losses(const ReportRow& row) {
  const Summary& summary = row.task->summary;
  std::string text = counts_text(summary.refused);
  if (text.empty() && row.refused > 0) text = std::to_string(row.refused);
  if (const std::string pictures = counts_text(summary.unreadable); !pictures.empty())
    text +=
        (text.empty() ? "" : "; ") + ((row.task->sequence.recorded.empty() ? "pictures: " : "the log: ") + pictures);
  if (summary.gaps > 0)
    text += (text.empty() ? "" : "; ") + ("the recording lacks " + counted_text(summary.gaps, "keyframe"));
  return text;
}

// The column of a row: why the recording failed, else what was lost; and what is wrong with the stereo pair.
std::string refusals(const ReportRow& row) {
  const Status& failure = row.task->failure;
  std::string text = failure.ok() ? losses(row) : std::string();
  for (const Status& finding : row.task->summary.findings)
    if (failure.message().find(finding.message()) == std::string::npos)  // the failure names it already
      text += (text.empty() ? "" : "; ") + ("eyes: " + finding.to_string());
  if (!failure.ok()) text += (text.empty() ? "" : "; ") + failure.to_string();
  return text.empty() ? "-" : text;
}

// "NOT TO BE TRUSTED: drives/06: 19.6 % measured (10 of 51 pairs, 41 pictures are missing)"
std::string distrust_text(const ReportRow& row) {
  if (!row.untrusted()) return {};
  const Task& task = *row.task;
  const Summary& summary = task.summary;
  std::string text = "NOT TO BE TRUSTED: " + task.sequence.session;
  if (summary.measured_share)
    text += ": " + terminal::fixed(100 * *summary.measured_share, 1) + " % measured (" +
            std::to_string(summary.measured) + " of " + std::to_string(summary.expected) + " pairs" +
            (summary.missing > 0 ? ", " + std::to_string(summary.missing) + " pictures are missing)" : ")");
  for (const Status& finding : summary.findings) text += "; " + std::string(reason_name(finding.reason()));
  if (!row.doubt.empty()) text += "; WRONG_CALIBRATION: " + row.doubt;
  return text;
}

// "NOT ALL IN THE MAP: drives/06: 2 of 51 keyframes were refused: 2 BAD_TRACK"
std::string loss_text(const ReportRow& row) {
  if (row.lost() == 0) return {};
  const std::string reasons = counts_text(row.task->summary.refused);
  return "NOT ALL IN THE MAP: " + row.task->sequence.session + ": " + count_text(row.lost()) + " of " +
         counted_text(std::max(row.keyframes + row.lost(), row.task->summary.keyframes), "keyframe") +
         (row.lost() == 1 ? " was" : " were") + " refused" + (reasons.empty() ? "" : ": " + reasons);
}

// Paths within the recording are shortened to the part after its folder.
std::string within(const Sequence& recording, const std::string& text) {
  return text.starts_with(recording.path + '/') ? text.substr(recording.path.size() + 1) : text;
}

// "3.png: neither PNG nor JPEG nor binary PGM (NOT_A_PICTURE)"
std::string left_out_text(const Task& task, const Status& left_out) {
  return within(task.sequence, left_out.message()) + " (" + std::string(reason_name(left_out.reason())) + ")";
}

// "drives/06: 41 pictures are missing, the first: image_1/000001.png, image_1/000002.png"
void print_missing(const Task& task, terminal::Console& console) {
  const Summary& summary = task.summary;
  if (!task.in_map() || summary.missing == 0) return;
  console.out() << task.sequence.session << ": " << counted_text(summary.missing, "picture")
                << (summary.missing == 1 ? " is" : " are") << " missing";
  for (std::size_t i = 0; i < summary.missing_first.size(); ++i)
    console.out() << (i == 0 ? ", the first: " : ", ") << within(task.sequence, summary.missing_first[i]);
  console.out() << '\n';
}

void print_left_out(const Task& task, terminal::Console& console) {
  constexpr std::size_t kNamed = 3;
  const std::vector<Status>& all = task.summary.left_out;
  if (!task.in_map() || all.empty()) return;
  console.out() << task.sequence.session << ": left out:\n";
  for (std::size_t i = 0; i < std::min(kNamed, all.size()); ++i)
    console.out() << "  " << left_out_text(task, all[i]) << '\n';
  if (all.size() > kNamed) console.out() << "  and " << count_text(all.size() - kNamed) << " more (--json lists all)\n";
}

std::vector<Json> json_of(const std::vector<Status>& statuses) {
  std::vector<Json> list;
  for (const Status& status : statuses)
    list.push_back(Json().add("reason", reason_name(status.reason())).add("message", status.message()));
  return list;
}

Json json_of(const std::map<std::string, std::uint64_t>& counts) {
  Json json;
  for (const auto& [reason, n] : counts) json.add(reason, n);
  return json;
}

}  // namespace

std::uint64_t ReportRow::lost() const {
  if (!task->in_map()) return 0;
  const std::uint64_t told = task->summary.refused_in_all();
  // The map counts refusals by session, and the parts of a session may be in several logs.
  return task->stage == Stage::kDone && !task->sequence.recorded.empty() ? told : std::max(told, refused);
}

std::vector<ReportRow> report_rows(const std::vector<Task>& tasks, const std::vector<client::Session>& sessions,
                                   const std::vector<client::Edge>& loops,
                                   const std::vector<client::DoubtfulCamera>& doubts) {
  std::map<std::string, const client::Session*> by_uuid;
  for (const client::Session& session : sessions) by_uuid[session.uuid] = &session;
  std::map<SessionNumber, std::uint64_t> loops_of;
  for (const client::Edge& loop : loops) ++loops_of[loop.b.session];
  std::vector<ReportRow> rows;
  for (const Task& task : tasks) {
    ReportRow& row = rows.emplace_back();
    row.task = &task;
    const auto found = by_uuid.find(task.sequence.uuid.to_string());
    if (found == by_uuid.end()) continue;
    row.session = found->second->number;
    row.keyframes = found->second->frames;
    row.refused = found->second->refused;
    row.given_up = found->second->given_up;
    row.loops = loops_of[row.session];
    for (const client::DoubtfulCamera& doubt : doubts)
      if (doubt.session == row.session) row.doubt = doubt.message;
  }
  return rows;
}

Status keep_doubts(const SummaryStore& store, const std::string& boot, std::vector<ReportRow>& rows) {
  Status kept;
  for (ReportRow& row : rows) {
    if (boot.empty() || !row.task->in_map()) continue;
    const SessionUuid& uuid = row.task->sequence.uuid;
    const auto before = store.doubt_of(uuid);
    const SummaryStore::Doubt now{boot, row.doubt};
    if (row.doubt.empty() && before && before->boot == boot)
      store.forget_doubt(uuid);
    else if (row.doubt.empty() && before)
      row.doubt = before->text;
    else if (!row.doubt.empty() && before != now)
      kept = store.doubt(uuid, now);
  }
  return kept;
}

void print_report(const std::vector<ReportRow>& rows, terminal::Console& console) {
  for (const ReportRow& row : rows)
    if (const std::string distrust = distrust_text(row); !distrust.empty()) console.out() << distrust << '\n';
  for (const ReportRow& row : rows)
    if (const std::string loss = loss_text(row); !loss.empty()) console.out() << loss << '\n';
  std::vector<std::vector<std::string>> cells;
  for (const ReportRow& row : rows) {
    // What a front-end measured before it failed says nothing of the whole recording.
    const Summary summary = row.task->stage == Stage::kFailed ? Summary() : row.task->summary;
    const auto of_session = [&](std::uint64_t n) { return row.session ? std::to_string(n) : "-"; };
    cells.push_back(
        {row.task->sequence.session, of_session(row.session), state_of(*row.task),
         summary.json.empty() ? "-" : std::to_string(summary.pairs), of_session(row.keyframes),
         summary.measured_share ? terminal::fixed(100 * *summary.measured_share, 1) + " %" : "-",
         summary.metric_share && summary.keyframes > 0 ? terminal::fixed(100 * *summary.metric_share, 1) + " %" : "-",
         of_session(row.loops), refusals(row)});
  }
  console.table({"recording", ">session", "", ">frames", ">keyframes", ">measured", ">metric", ">loops", "refused"},
                cells);
  for (const ReportRow& row : rows) {
    print_missing(*row.task, console);
    print_left_out(*row.task, console);
  }
}

std::string report_json(const std::vector<ReportRow>& rows, double wall_s) {
  std::vector<Json> sequences;
  std::uint64_t pairs = 0, keyframes = 0, failed = 0, incomplete = 0, untrusted = 0;
  for (const ReportRow& row : rows) {
    const Task& task = *row.task;
    Json json;
    json.add("path", task.sequence.path)
        .add("name", task.sequence.session)
        .add("uuid", task.sequence.uuid.to_string())
        .add("session", std::uint64_t{row.session})
        .add("state", state_of(task))
        .add("frames", task.summary.pairs)
        .add("frames_lost", task.summary.lost)
        .add("keyframes", row.keyframes);
    const bool failed_itself = task.stage == Stage::kFailed;
    if (task.summary.metric_share && !failed_itself) json.add("metric_share", *task.summary.metric_share);
    json.add("trusted", !row.untrusted())
        .add("expected", task.summary.expected)
        .add("seen", task.summary.seen)
        .add("measured", task.summary.measured)
        .add("pictures_missing", task.summary.missing);
    if (task.summary.measured_share && !failed_itself) json.add("measured_share", *task.summary.measured_share);
    json.add("findings", json_of(task.summary.findings))
        .add("loops", row.loops)
        .add("refused", json_of(task.summary.refused))
        .add("keyframes_refused", row.lost())
        .add("pictures_refused", json_of(task.summary.unreadable))
        .add("left_out", json_of(task.summary.left_out))
        .add("folders_passed_over", task.sequence.folders_passed_over)
        .add("files_passed_over", task.sequence.files_passed_over)
        .add("supposed_rate_hz", task.sequence.supposed_rate_hz)
        .add("given_up", row.given_up)
        .add("gaps", task.summary.gaps);
    if (!row.doubt.empty()) json.add("calibration_in_doubt", row.doubt);
    if (!task.failure.ok())
      json.add("error",
               Json().add("reason", reason_name(task.failure.reason())).add("message", task.failure.message()));
    sequences.push_back(std::move(json));
    pairs += task.summary.pairs;
    keyframes += row.keyframes;
    failed += failed_itself;
    incomplete += row.lost() > 0;
    untrusted += row.untrusted();
  }
  return Json()
      .add("sequences", sequences)
      .add("frames", pairs)
      .add("keyframes", keyframes)
      .add("failed", failed)
      .add("incomplete", incomplete)
      .add("untrusted", untrusted)
      .add("wall_s", wall_s)
      .text();
}

}  // namespace relmap::batch
