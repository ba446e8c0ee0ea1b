#include "tools/batch/front_end.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

namespace relmap::batch {

namespace {

using Document = nlohmann::json;

constexpr std::size_t kMaxText = std::size_t{64} << 20;  // a summary names every picture that was left out

Status system_error(const std::string& what) { return {Reason::IO_ERROR, what + ": " + std::strerror(errno)}; }

// An object.
std::optional<Document> parse(const std::string& json) {
  Document document = Document::parse(json, nullptr, false);
  if (!document.is_object()) return std::nullopt;
  return document;
}

// What is missing, or of another type, is 0, empty or an empty list: an older front-end did not say it.
const Document& member(const Document& object, const char* key) {
  static const Document kNull;
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found == object.end() ? kNull : *found;
}

std::uint64_t number(const Document& value) { return value.is_number_unsigned() ? value.get<std::uint64_t>() : 0; }
std::uint64_t number(const Document& object, const char* key) { return number(member(object, key)); }

std::optional<double> real_number(const Document& object, const char* key) {
  const Document& value = member(object, key);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::string text(const Document& object, const char* key) {
  const Document& value = member(object, key);
  return value.is_string() ? value.get<std::string>() : "";
}

std::map<std::string, std::uint64_t> counts(const Document& object) {
  std::map<std::string, std::uint64_t> counts;
  if (object.is_object())
    for (const auto& [name, count] : object.items()) counts[name] = number(count);
  return counts;
}

// Of an object that has its members.
std::optional<RecordingIdentity> recording_of(const Document& object) {
  if (!object.contains("fingerprint")) return std::nullopt;
  return RecordingIdentity{text(object, "fingerprint"), number(object, "count"), text(object, "contents"),
                           text(object, "calibration")};
}

std::vector<std::string> texts(const Document& list) {
  std::vector<std::string> texts;
  if (list.is_array())
    for (const Document& entry : list)
      if (entry.is_string()) texts.push_back(entry.get<std::string>());
  return texts;
}

Reason reason_named(const std::string& name) {
  for (std::uint16_t number = 0; number < 256; ++number)
    if (is_reason(number) && reason_name(static_cast<Reason>(number)) == name) return static_cast<Reason>(number);
  return Reason::INTERNAL;
}

// [{"reason": ..., "message": ...}, ...]
std::vector<Status> statuses(const Document& list) {
  std::vector<Status> statuses;
  if (list.is_array())
    for (const Document& entry : list)
      statuses.emplace_back(reason_named(text(entry, "reason")), text(entry, "message"));
  return statuses;
}

// Parses the last "relmap-frontend: NOT_STEREO: the eyes are ..." of its standard error.
Status failure_in(const std::string& text, const std::string& otherwise) {
  const std::string_view all(text);
  constexpr std::string_view kPrefix = "relmap-frontend: ";
  const std::size_t begin = all.rfind(kPrefix);
  if (begin == std::string_view::npos) {
    const std::string last(all.substr(all.substr(0, all.find_last_not_of('\n') + 1).rfind('\n') + 1));
    return {Reason::INTERNAL, last.empty() ? otherwise : last.substr(0, last.find('\n'))};
  }
  const std::string_view line = all.substr(begin + kPrefix.size(), all.find('\n', begin) - begin - kPrefix.size());
  const std::size_t colon = line.find(": ");
  if (colon == std::string_view::npos) return {Reason::INTERNAL, std::string(line)};
  return {reason_named(std::string(line.substr(0, colon))), std::string(line.substr(colon + 2))};
}

}  // namespace

Result<Summary> read_summary(const std::string& json) {
  const auto node = parse(json);
  if (!node || !node->contains("keyframes")) return {Reason::CORRUPT, "no summary of a front-end"};
  Summary summary;
  summary.json = json;
  summary.pairs = number(*node, "pairs");
  summary.lost = number(*node, "lost");
  summary.keyframes = number(*node, "keyframes");
  summary.unsettled = number(*node, "unsettled");
  summary.gaps = number(*node, "gaps");
  summary.metric_share = real_number(*node, "metric_share");
  summary.refused = counts(member(*node, "refused"));
  summary.unreadable = counts(member(*node, "unreadable"));
  summary.stamps_refused = counts(member(*node, "stamps_refused"));
  summary.trusted = member(*node, "trusted") != false;
  summary.expected = number(*node, "expected");
  summary.seen = number(*node, "seen");
  summary.measured = number(*node, "measured");
  summary.measured_share = real_number(*node, "measured_share");
  const Document& missing = member(*node, "missing");
  summary.missing = number(missing, "count");
  summary.missing_first = texts(member(missing, "first"));
  summary.findings = statuses(member(*node, "findings"));
  summary.left_out = statuses(member(*node, "left_out"));
  summary.recording = recording_of(member(*node, "recording"));
  return summary;
}

std::optional<RecordingIdentity> read_recording(const std::string& json) {
  const auto node = parse(json);
  return node ? recording_of(member(*node, "recording")) : std::nullopt;
}

std::uint64_t Summary::refused_in_all() const {
  std::uint64_t sum = 0;
  for (const auto& [reason, count] : refused) sum += count;
  return sum;
}

Result<FrontEnd> FrontEnd::start(const std::vector<std::string>& command) {
  int out[2], err[2];
  if (::pipe2(out, O_CLOEXEC) != 0) return system_error("no pipe");
  if (::pipe2(err, O_CLOEXEC) != 0) {
    const Status status = system_error("no pipe");
    ::close(out[0]);
    ::close(out[1]);
    return status;
  }
  std::vector<char*> argv;
  for (const std::string& argument : command) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(127);
    ::setpgid(0, 0);  // so that Ctrl-C reaches the batch alone, which passes it on
    ::signal(SIGINT, SIG_DFL);
    ::signal(SIGTERM, SIG_DFL);
    ::dup2(out[1], STDOUT_FILENO);
    ::dup2(err[1], STDERR_FILENO);
    const int null = ::open("/dev/null", O_RDONLY);
    if (null >= 0) ::dup2(null, STDIN_FILENO);
    ::execvp(argv[0], argv.data());
    const std::string why = "relmap-frontend: NO_SUCH_FILE: " + command[0] + ": " + std::strerror(errno) + "\n";
    (void)!::write(STDERR_FILENO, why.data(), why.size());
    ::_exit(127);
  }
  const int failed = errno;
  ::close(out[1]);
  ::close(err[1]);
  FrontEnd front_end;
  front_end.out_ = out[0];
  front_end.err_ = err[0];
  if (pid < 0) {
    errno = failed;
    return system_error("cannot start " + command[0]);
  }
  front_end.pid_ = pid;
  for (const int file : {out[0], err[0]}) ::fcntl(file, F_SETFL, O_NONBLOCK);
  return front_end;
}

FrontEnd::FrontEnd(FrontEnd&& other) noexcept { *this = std::move(other); }

FrontEnd& FrontEnd::operator=(FrontEnd&& other) noexcept {
  if (this == &other) return *this;
  close_all();
  pid_ = std::exchange(other.pid_, -1);
  out_ = std::exchange(other.out_, -1);
  err_ = std::exchange(other.err_, -1);
  out_text_ = std::move(other.out_text_);
  err_text_ = std::move(other.err_text_);
  progress_ = std::move(other.progress_);
  summary_ = std::move(other.summary_);
  lines_ = std::move(other.lines_);
  status_ = std::move(other.status_);
  interrupted_ = other.interrupted_;
  ended_by_signal_ = other.ended_by_signal_;
  return *this;
}

FrontEnd::~FrontEnd() { close_all(); }

void FrontEnd::close_all() {
  for (int* file : {&out_, &err_})
    if (const int open = std::exchange(*file, -1); open >= 0) ::close(open);
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(std::exchange(pid_, -1), nullptr, 0);
}

void FrontEnd::read(int& file, std::string& text) {
  char buffer[4096];
  while (file >= 0) {
    const ssize_t size = ::read(file, buffer, sizeof buffer);
    if (size > 0) {
      text.append(buffer, static_cast<std::size_t>(size));
      if (text.size() > kMaxText) text.erase(0, text.size() - kMaxText);
    } else if (size < 0 && errno == EINTR) {
      continue;
    } else if (size < 0 && errno == EAGAIN) {
      return;
    } else {
      ::close(std::exchange(file, -1));
    }
  }
}

void FrontEnd::take_lines() {
  for (std::size_t end; (end = out_text_.find('\n')) != std::string::npos; out_text_.erase(0, end + 1)) {
    const std::string line = out_text_.substr(0, end);
    if (auto summary = line.find("\"metric_share\"") == std::string::npos ? Result<Summary>(Reason::CORRUPT, "")
                                                                          : read_summary(line);
        summary.ok()) {
      summary_ = std::move(*summary);
      continue;
    }
    const auto node = parse(line);
    if (!node || !node->contains("pairs")) {
      lines_.push_back(line);
      continue;
    }
    progress_.pairs = number(*node, "pairs");
    progress_.of = number(*node, "of");
    progress_.keyframes = number(*node, "keyframes");
    progress_.settled = number(*node, "settled");
    progress_.trouble = text(*node, "trouble");
  }
}

bool FrontEnd::take() {
  read(out_, out_text_);
  read(err_, err_text_);
  take_lines();
  if (pid_ < 0) return true;
  if (out_ >= 0 || err_ >= 0) return false;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return false;
  pid_ = -1;
  judge(status);
  return true;
}

void FrontEnd::wait(int milliseconds) const {
  pollfd files[] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}};  // negative ones are left out
  // Both closed: it is about to end.
  (void)::poll(files, 2, out_ < 0 && err_ < 0 ? std::min(milliseconds, 5) : milliseconds);
}

void FrontEnd::interrupt() {
  interrupted_ = true;
  if (pid_ > 0) ::kill(pid_, SIGTERM);
}

void FrontEnd::judge(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    ended_by_signal_ = true;
    status_ = {Reason::INTERNAL, "the front-end was ended by signal " + std::to_string(WTERMSIG(wait_status))};
    return;
  }
  const int code = WEXITSTATUS(wait_status);
  // Refused keyframes, and those that the recording lacks, are not worth another try: they are only counted.
  const bool settled = code == 3 && summary_.unsettled == 0 && (!summary_.refused.empty() || summary_.gaps > 0);
  const bool done_but_untrusted = code == 5 && !summary_.json.empty();
  if (code == 0 || settled || done_but_untrusted) return;
  if (interrupted_)
    status_ = {Reason::SHUTTING_DOWN, "interrupted"};
  else if (code == 3)
    status_ = {Reason::UNREACHABLE, progress_.trouble.empty() ? "not all keyframes were settled" : progress_.trouble};
  else
    status_ = failure_in(err_text_, "the front-end ended with " + std::to_string(code));
}

std::string front_end_program() {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto beside = self.parent_path() / "relmap-frontend";
  return !error && std::filesystem::exists(beside, error) ? beside.string() : "relmap-frontend";
}

namespace {

// The lines that relmap-frontend --list prints, each a JSON object.
Result<std::vector<Document>> listed(const std::vector<std::string>& arguments) {
  std::vector<std::string> command{front_end_program(), "--list"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  auto front_end = FrontEnd::start(command);
  if (!front_end.ok()) return front_end.status();
  while (!front_end->take()) front_end->wait(1000);
  if (!front_end->status().ok()) return front_end->status();
  std::vector<Document> nodes;
  for (const std::string& line : front_end->lines()) {
    auto node = parse(line);
    if (!node) return {Reason::CORRUPT, "relmap-frontend --list said: " + line};
    nodes.push_back(std::move(*node));
  }
  return nodes;
}

Result<std::vector<LoggedSession>> list_log(const std::string& path) {
  const auto nodes = listed({"--source", "log", path});
  if (!nodes.ok()) return nodes.status();
  std::vector<LoggedSession> sessions;
  for (const Document& node : *nodes) {
    const auto uuid = SessionUuid::parse(text(node, "uuid"));
    if (!uuid) return {Reason::CORRUPT, "relmap-frontend --list named a session without a uuid"};
    sessions.push_back({*uuid, text(node, "name"), static_cast<std::uint32_t>(number(node, "first")),
                        static_cast<std::uint32_t>(number(node, "last"))});
  }
  return sessions;
}

Result<PhotographFolder> list_photographs(const std::string& path, const RecordingOptions& options) {
  std::vector<std::string> arguments{"--source", "images", "--mono", path};
  if (!options.calibration.empty()) arguments.insert(arguments.end(), {"--calibration", options.calibration});
  const auto nodes = listed(arguments);
  if (!nodes.ok()) return nodes.status();
  PhotographFolder folder;
  for (const Document& node : *nodes) {
    Status unlisted;
    if (const Document& error = member(node, "error"); error.is_object())
      unlisted = {reason_named(text(error, "reason")), text(error, "message")};
    folder.cameras.push_back({text(node, "camera"), number(node, "pictures"), recording_of(node), unlisted});
    folder.folders_passed_over = texts(member(node, "folders_passed_over"));
    folder.files_passed_over = texts(member(node, "files_passed_over"));
  }
  return folder;
}

Result<ListedRecording> list_recording(const std::string& path, const RecordingOptions& options) {
  std::vector<std::string> arguments{"--source", options.source, path};
  if (!options.calibration.empty()) arguments.insert(arguments.end(), {"--calibration", options.calibration});
  const auto nodes = listed(arguments);
  if (!nodes.ok()) return nodes.status();
  const auto recording = nodes->size() == 1 ? recording_of(nodes->front()) : std::nullopt;
  if (!recording) return {Reason::CORRUPT, "relmap-frontend --list did not say what " + path + " is"};
  return ListedRecording{*recording, text(nodes->front(), "robot"), text(nodes->front(), "name"),
                         real_number(nodes->front(), "supposed_rate_hz").value_or(0)};
}

}  // namespace

RecordingLister front_end_lister() { return {list_log, list_photographs, list_recording}; }

}  // namespace relmap::batch
