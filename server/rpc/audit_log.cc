#include "server/rpc/audit_log.h"

#include <fcntl.h>
#include <google/protobuf/text_format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/json.h"
#include "proto/base/time_text.h"

namespace relmap::rpc {

namespace {

constexpr std::size_t kMaxPrinted = 64 * 1024;  // an imported graph has megabytes
constexpr std::size_t kMaxLines = 1024;         // that wait to be written
constexpr std::size_t kMaxCallers = 1024;       // whose failures are counted each by themselves
constexpr std::chrono::minutes kCounted{1};

std::string line_of(const AuditLog::Entry& entry) {
  Json line;
  line.add("time", time_text(now_us()))
      .add("who", entry.who)
      .add("role", entry.who.empty() ? std::string() : entry.role)
      .add("from", entry.from)
      .add("method", entry.method)
      .add("request", entry.request)
      .add("request_id", entry.request_id)
      .add("outcome", reason_name(entry.outcome.reason()))
      .add("message", entry.outcome.message())
      .add("seconds", 1e-6 * static_cast<double>(entry.took.count()));
  if (!entry.trace_id.empty()) line.add("trace_id", entry.trace_id);
  return line.text() + "\n";
}

bool write_all(int file, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t size = ::write(file, text.data() + done, text.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    done += static_cast<std::size_t>(size);
  }
  return true;
}

}  // namespace

Result<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& file, std::uint64_t file_bytes) {
  std::unique_ptr<AuditLog> log(new AuditLog(file, file_bytes));
  if (Status opened = log->reopen(); !opened.ok()) return opened;
  log->thread_ = std::thread([writer = log.get()] { writer->run(); });
  return log;
}

AuditLog::~AuditLog() {
  {
    const MutexLock lock(mutex_);
    sum_up(Clock::time_point::max());
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status AuditLog::reopen() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = ::open(file_.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR);
  struct stat facts {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &facts) != 0)
    return {Reason::IO_ERROR, "cannot write " + file_ + ": " + std::strerror(errno)};
  written_ = static_cast<std::uint64_t>(facts.st_size);
  char last = '\n';
  if (written_ > 0 && ::pread(descriptor_, &last, 1, facts.st_size - 1) != 1)
    return {Reason::IO_ERROR, "cannot read " + file_ + ": " + std::strerror(errno)};
  torn_ = last != '\n';  // by a kill or a full disk
  return {};
}

// Moves the files on by one number, up to the first that is free, so that nothing is lost where it is done again
// because it failed half way.
void AuditLog::rotate() {
  int free = 1;
  while (free < kOldFiles && ::access(old_file(free).c_str(), F_OK) == 0) ++free;
  for (int number = free - 1; number > 0; --number)
    (void)std::rename(old_file(number).c_str(), old_file(number + 1).c_str());
  (void)std::rename(file_.c_str(), old_file(1).c_str());
}

void AuditLog::write(const Entry& entry) {
  const MutexLock lock(mutex_);
  sum_up(Clock::now() - kCounted);
  if (lists(entry)) queue(line_of(entry));
}

bool AuditLog::flush(Clock::time_point until) {
  const MutexLock lock(mutex_);
  return changed_.wait_until(mutex_, until, [this]() RELMAP_REQUIRES(mutex_) { return lines_.empty() && !writing_; });
}

Result<AuditPage> AuditLog::read(const AuditQuery& query, const std::function<Status()>& proceed) {
  constexpr std::chrono::seconds kFlush{1};  // a disk that takes longer does not keep the rest from being read
  (void)flush(Clock::now() + kFlush);
  std::vector<std::unique_ptr<storage::ReadFile>> files;
  {
    const auto disk = storage::posix_file_system();
    const MutexLock lock(files_);
    for (int number = 0; number <= kOldFiles; ++number) {
      auto file = disk->open_read(number == 0 ? file_ : old_file(number));
      if (!file.ok() && file.reason() != Reason::NO_SUCH_FILE) return file.status();
      if (file.ok() && (*file)->size() > 0) files.push_back(*std::move(file));
    }
  }
  return read_audit(files, query, proceed);
}

// Whether the call has a line of its own.
bool AuditLog::lists(const Entry& entry) {
  if (entry.outcome.ok()) return true;
  std::string caller = entry.who.empty() ? entry.from.substr(0, entry.from.rfind(':')) : entry.who;
  if (failures_.size() >= kMaxCallers && !failures_.contains(caller)) caller.clear();
  Failures& failures = failures_.try_emplace(caller, Failures{Clock::now(), 0, 0, {}}).first->second;
  if (++failures.listed <= kFailuresListed) return true;
  ++failures.unlisted;
  failures.last = entry;
  return false;
}

// Lists the number of those that have no line, for callers whose minute began before `until`.
void AuditLog::sum_up(Clock::time_point until) {
  for (auto it = failures_.begin(); it != failures_.end();) {
    if (it->second.since > until) {
      ++it;
      continue;
    }
    if (it->second.unlisted > 0) {
      Entry entry = std::move(it->second.last);
      entry.outcome = {entry.outcome.reason(), std::to_string(it->second.unlisted) +
                                                   " calls within a minute failed and are not listed, this one last: " +
                                                   entry.outcome.message()};
      queue(line_of(entry));
    }
    it = failures_.erase(it);
  }
}

void AuditLog::queue(std::string line) {
  if (lines_.size() >= kMaxLines) {
    ++lost_;
    return;
  }
  lines_.push_back(std::move(line));
  changed_.notify_all();
}

void AuditLog::run() {
  for (MutexLock lock(mutex_);;) {
    // Wakes now and then, so that what was not listed is told also where nobody calls any more.
    changed_.wait_for(mutex_, kCounted, [this]() RELMAP_REQUIRES(mutex_) { return stopping_ || !lines_.empty(); });
    sum_up(Clock::now() - kCounted);
    if (lines_.empty()) {
      if (stopping_) return;
      continue;
    }
    std::string line = std::move(lines_.front());
    lines_.pop_front();
    if (const std::uint64_t lost = std::exchange(lost_, 0); lost > 0) {
      Entry entry;
      entry.outcome = {Reason::IO_ERROR, std::to_string(lost) + " lines are lost, since the disk took too long"};
      line += line_of(entry);
    }
    writing_ = true;
    lock.unlock();
    put(line);
    lock.lock();
    writing_ = false;
    changed_.notify_all();
  }
}

void AuditLog::put(const std::string& line) {
  Status status;
  if (descriptor_ < 0 || written_ >= file_bytes_) {
    const MutexLock lock(files_);
    if (written_ >= file_bytes_) rotate();
    written_ = 0;  // also where it cannot be opened now
    status = reopen();
  }
  if (status.ok()) {
    const std::string text = torn_ ? "\n" + line : line;
    torn_ = !write_all(descriptor_, text);
    if (torn_)
      status = {Reason::IO_ERROR, "cannot write " + file_ + ": " + std::strerror(errno)};
    else
      written_ += text.size();
  }
  if (!status.ok() && !failing_) spdlog::error("the audit log is incomplete: {}", status.to_string());
  failing_ = !status.ok();
}

std::string AuditLog::text_of(const google::protobuf::Message& request) {
  if (request.ByteSizeLong() > kMaxPrinted) return std::to_string(request.ByteSizeLong()) + " bytes";
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.SetTruncateStringFieldLongerThan(256);
  std::string text;
  if (!printer.PrintToString(request, &text)) return {};
  if (text.size() > kMaxRequest) text = text.substr(0, kMaxRequest) + "...";
  return text;
}

}  // namespace relmap::rpc
