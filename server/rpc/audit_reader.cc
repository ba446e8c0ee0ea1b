#include "server/rpc/audit_reader.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/base/json.h"
#include "proto/base/json_object.h"
#include "proto/base/read_number.h"
#include "proto/base/time_text.h"
#include "relmap/v1/reason.pb.h"

namespace relmap::rpc {

namespace {

constexpr std::size_t kBlockBytes = 64 * 1024, kMaxLineBytes = 64 * 1024;

struct Line {
  std::string text;  // without its end
  std::uint64_t begin = 0;
  bool whole = true;  // false: it is too long, and `text` is its beginning
};

// The lines of a file, from some place back to its beginning.
class LinesBackward {
 public:
  LinesBackward(const storage::ReadFile& file, std::uint64_t end) : file_(file), begin_(end) {}

  // The line before; nullopt before the first. IO_ERROR.
  Result<std::optional<Line>> previous() {
    for (bool too_long = false;; too_long |= drop_if_too_long()) {
      if (!text_.empty() || begin_ == 0) {
        if (text_.empty() && !too_long) return std::optional<Line>();
        const std::size_t size = text_.size() - (!text_.empty() && !too_long && text_.back() == '\n');
        const std::size_t before = size == 0 ? std::string::npos : text_.rfind('\n', size - 1);
        if (before != std::string::npos || begin_ == 0) {
          const std::size_t at = before == std::string::npos ? 0 : before + 1;
          Line line{text_.substr(at, size - at), begin_ + at, !too_long};
          text_.resize(at);
          return std::optional(std::move(line));
        }
      }
      const std::size_t more = static_cast<std::size_t>(std::min<std::uint64_t>(kBlockBytes, begin_));
      const auto bytes = file_.read(begin_ - more, more);
      if (!bytes.ok()) return bytes.status();
      begin_ -= more;
      text_.insert(0, reinterpret_cast<const char*>(bytes->data()), bytes->size());
    }
  }

 private:
  bool drop_if_too_long() {
    if (text_.size() <= kMaxLineBytes || text_.rfind('\n', text_.size() - 2) != std::string::npos) return false;
    text_.clear();
    return true;
  }

  const storage::ReadFile& file_;
  std::uint64_t begin_;  // of text_
  std::string text_;     // what has been read and not told
};

// A file is known by its first line, which has a time and an id.
Result<std::string> name_of(const storage::ReadFile& file) {
  constexpr std::uint64_t kLooked = 4096;
  auto bytes = file.read(0, static_cast<std::size_t>(std::min(kLooked, file.size())));
  if (!bytes.ok()) return bytes.status();
  bytes->resize(static_cast<std::size_t>(std::find(bytes->begin(), bytes->end(), '\n') - bytes->begin()));
  return hex(crc32c(*bytes));
}

std::optional<AuditRead> entry_of(std::string_view line) {
  const auto object = JsonObject::parse(line);
  if (!object) return std::nullopt;
  const std::string* time = object->text("time");
  const std::string* outcome = object->text("outcome");
  const auto time_us = time ? time_of_text(*time) : std::nullopt;
  v1::Reason reason = v1::REASON_OK;
  if (!time_us || !outcome || !object->text("method") || !v1::Reason_Parse("REASON_" + *outcome, &reason))
    return std::nullopt;
  const auto text = [&](std::string_view key) {
    const std::string* found = object->text(key);
    return found ? *found : std::string();
  };
  AuditRead entry;
  entry.time_us = *time_us;
  entry.who = text("who");
  entry.role = text("role");
  entry.from = text("from");
  entry.method = text("method");
  entry.request = text("request");
  entry.request_id = text("request_id");
  entry.outcome = static_cast<Reason>(reason);
  entry.message = text("message");
  entry.seconds = object->number("seconds").value_or(0);
  entry.trace_id = text("trace_id");
  return entry;
}

class PageReader {
 public:
  PageReader(const std::vector<std::unique_ptr<storage::ReadFile>>& files, const AuditQuery& query,
             const std::function<Status()>& proceed, std::uint64_t max_bytes)
      : files_(files),
        query_(query),
        proceed_(proceed),
        left_(max_bytes),
        who_(Json::quoted(query.who)),
        method_(Json::quoted(query.method)) {}

  Result<AuditPage> read() {
    std::size_t number = 0;
    std::uint64_t end = files_.empty() ? 0 : files_[0]->size();
    if (!query_.token.empty()) {
      const auto begin = find(query_.token);
      if (!begin.ok()) return begin.status();
      std::tie(number, end) = *begin;
    }
    for (; number < files_.size(); ++number) {
      const storage::ReadFile& file = *files_[number];
      if (end == 0 || end > file.size()) end = file.size();  // 0: all of an older file
      const auto use = use_of(file);
      if (!use.ok()) return use.status();
      if (*use == Use::kEnd) break;
      if (*use == Use::kRead) {
        const auto at = read_file(file, end);
        if (!at.ok()) return at.status();
        if (is_full() && (*at > 0 || number + 1 < files_.size())) {
          const auto next = *at > 0 ? token(file, *at) : token(*files_[number + 1], files_[number + 1]->size());
          if (!next.ok()) return next.status();
          page_.next = *next;
          break;
        }
      }
      end = 0;
    }
    return std::move(page_);
  }

 private:
  enum class Use { kRead, kSkip, kEnd };

  bool is_full() const {
    return page_.entries.size() >= query_.max_entries || bytes_ >= kMaxAuditEntryBytesPerPage || left_ == 0;
  }

  // Whether the file is to be read, by the times of its first and its last entry. The clock may have been set back
  // between them, but a whole file without anything so new has nothing newer before it.
  Result<Use> use_of(const storage::ReadFile& file) {
    if (query_.from_us == 0 && query_.until_us == 0) return Use::kRead;
    auto first = LinesBackward(file, std::min<std::uint64_t>(file.size(), kMaxLineBytes));
    std::optional<std::int64_t> oldest;
    for (auto line = first.previous();; line = first.previous()) {
      if (!line.ok()) return line.status();
      if (!*line) break;
      if ((*line)->begin == 0)
        if (const auto entry = entry_of((*line)->text)) oldest = entry->time_us;
    }
    const auto last = LinesBackward(file, file.size()).previous();
    if (!last.ok()) return last.status();
    const auto newest = *last ? entry_of((*last)->text) : std::nullopt;
    if (!oldest || !newest) return Use::kRead;
    if (query_.from_us != 0 && std::max(*oldest, newest->time_us) < query_.from_us) return Use::kEnd;
    if (query_.until_us != 0 && std::min(*oldest, newest->time_us) >= query_.until_us) return Use::kSkip;
    return Use::kRead;
  }

  // Reads from `end` back until the page is full; returns where the next page goes on, 0 if nothing is left.
  Result<std::uint64_t> read_file(const storage::ReadFile& file, std::uint64_t end) {
    LinesBackward lines(file, end);
    for (std::uint64_t at = end, looked = end;;) {
      if (looked - at >= kBlockBytes || at == end) {
        looked = at;
        if (Status status = proceed_(); !status.ok()) return status;
      }
      if (is_full()) return at;
      const auto line = lines.previous();
      if (!line.ok()) return line.status();
      if (!*line) return std::uint64_t{0};
      left_ -= std::min(left_, at - (*line)->begin);
      at = (*line)->begin;
      take(**line);
    }
  }

  void take(const Line& line) {
    const std::string_view text = line.text;
    if (text.empty()) return;
    const bool looks_whole = line.whole && text.front() == '{' && text.back() == '}';
    // Most lines are ruled out without being parsed.
    if (looks_whole && !query_.who.empty() && text.find(who_) == std::string_view::npos) return;
    if (looks_whole && !query_.method.empty() && text.find(method_) == std::string_view::npos) return;
    auto entry = looks_whole ? entry_of(text) : std::nullopt;
    if (!entry) {
      ++page_.unreadable;
      return;
    }
    if ((query_.from_us == 0 || entry->time_us >= query_.from_us) &&
        (query_.until_us == 0 || entry->time_us < query_.until_us) &&
        (query_.who.empty() || entry->who == query_.who) && (query_.method.empty() || entry->method == query_.method) &&
        (!query_.failed || entry->outcome != Reason::OK)) {
      page_.entries.push_back(*std::move(entry));
      bytes_ += text.size();
    }
  }

  Result<std::string> token(const storage::ReadFile& file, std::uint64_t end) const {
    auto name = name_of(file);
    if (!name.ok()) return name.status();
    return *name + "-" + std::to_string(end);
  }

  // The number of the file and the end of the page.
  Result<std::pair<std::size_t, std::uint64_t>> find(const std::string& token) const {
    constexpr std::size_t kName = 8;
    std::uint64_t end = 0;
    if (token.size() <= kName + 1 || token[kName] != '-') return not_ours(token);
    if (!read_number(std::string_view(token).substr(kName + 1), end) || end == 0) return not_ours(token);
    for (std::size_t number = 0; number < files_.size(); ++number) {
      const auto name = name_of(*files_[number]);
      if (!name.ok()) return name.status();
      if (token.compare(0, kName, *name) == 0) return std::pair(number, end);
    }
    return {Reason::VIEW_EXPIRED, "this part of the audit log has been deleted since, with all before it; begin again"};
  }
  static Status not_ours(const std::string& token) {
    return {Reason::INVALID_ARGUMENT, "'" + token.substr(0, 64) + "' is not a token of the audit log"};
  }

  const std::vector<std::unique_ptr<storage::ReadFile>>& files_;
  const AuditQuery& query_;
  const std::function<Status()>& proceed_;
  std::uint64_t left_;              // bytes that may be read
  std::size_t bytes_ = 0;           // of the lines of page_
  const std::string who_, method_;  // as they stand in a line
  AuditPage page_;
};

}  // namespace

Result<AuditPage> read_audit(const std::vector<std::unique_ptr<storage::ReadFile>>& files, const AuditQuery& query,
                             const std::function<Status()>& proceed, std::uint64_t max_bytes) {
  return PageReader(files, query, proceed, max_bytes).read();
}

}  // namespace relmap::rpc
