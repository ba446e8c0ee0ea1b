#include "proto/access/access_list.h"

#include <algorithm>
#include <ctime>
#include <set>
#include <utility>

#include "proto/access/file.h"
#include "proto/base/hex.h"

namespace relmap::access {

namespace {

constexpr std::string_view kHeader = "# KIND HASH ROLE EXPIRES STATE NAME\n";
constexpr std::size_t kHashDigits = 64;

bool is_hash(std::string_view text) {
  return text.size() == kHashDigits &&
         std::all_of(text.begin(), text.end(), [](char c) { return hex_digit(c) >= 0 && (c < 'A' || c > 'F'); });
}

// Takes the first word off `line`.
std::string_view word_of(std::string_view& line) {
  const std::size_t end = std::min(line.find(' '), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(std::min(end + 1, line.size()));
  return word;
}

Result<Grant> parse_line(std::string_view line) {
  const auto bad = [](const std::string& what) { return Status(Reason::BAD_CONFIG, what); };
  Grant grant;
  const std::string_view kind = word_of(line);
  if (kind == "certificate")
    grant.kind = Grant::Kind::kCertificate;
  else if (kind == "key")
    grant.kind = Grant::Kind::kKey;
  else if (kind != "token")
    return bad("'" + std::string(kind) + "' is none of token, certificate, key");
  grant.hash = word_of(line);
  if (!is_hash(grant.hash)) return bad("the second word has not 64 hexadecimal digits");
  const std::string_view role_word = word_of(line);
  const auto role = role_of(role_word);
  if (!role) return bad("'" + std::string(role_word) + "' is none of reader, robot, operator");
  const std::string_view expiry = word_of(line);
  const auto expires = time_of(expiry);
  if (!expires) return bad("'" + std::string(expiry) + "' is no time like 2027-11-29T00:00:00Z");
  const std::string_view state = word_of(line);
  if (state != "valid" && state != "revoked") return bad("'" + std::string(state) + "' is neither valid nor revoked");
  if (Status name = check_principal_name(line); !name.ok()) return bad(name.message());
  grant.principal = {*role, std::string(line)};
  grant.expires_s = *expires;
  grant.revoked = state == "revoked";
  return grant;
}

}  // namespace

std::string_view kind_name(Grant::Kind kind) {
  switch (kind) {
    case Grant::Kind::kToken:
      return "token";
    case Grant::Kind::kCertificate:
      return "certificate";
    case Grant::Kind::kKey:
      return "key";
  }
  return "";
}

Result<AccessList> AccessList::parse(std::string_view text, const std::string& name) {
  // An empty file is one that was cut short: with it, what was revoked would be valid again.
  if (!text.starts_with(kHeader))
    return Status(Reason::BAD_CONFIG,
                  name + ":1: needs the line " + std::string(kHeader.substr(0, kHeader.size() - 1)));
  AccessList list;
  std::set<std::string> seen;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.front() == '#') continue;
    auto grant = parse_line(line);
    const auto wrong = [&](const std::string& what) {
      return Status(Reason::BAD_CONFIG, name + ":" + std::to_string(number) + ": " + what);
    };
    if (!grant.ok()) return wrong(grant.status().message());
    if (!seen.insert(grant->hash).second) return wrong("this hash is there twice");
    list.add(std::move(*grant));
  }
  return list;
}

std::string AccessList::text() const {
  std::string text(kHeader);
  for (const Grant& grant : grants_) {
    text.append(kind_name(grant.kind)).append(" ").append(grant.hash).append(" ");
    text.append(role_name(grant.principal.role)).append(" ").append(time_text(grant.expires_s));
    text.append(grant.revoked ? " revoked " : " valid ").append(grant.principal.name).append("\n");
  }
  return text;
}

const Grant* AccessList::find(Grant::Kind kind, std::string_view hash) const {
  const auto found = std::find_if(grants_.begin(), grants_.end(),
                                  [&](const Grant& grant) { return grant.kind == kind && grant.hash == hash; });
  return found == grants_.end() ? nullptr : &*found;
}

std::size_t AccessList::revoke(std::string_view name) {
  std::size_t count = 0;
  for (Grant& grant : grants_)
    if (grant.principal.name == name && !std::exchange(grant.revoked, true)) ++count;
  return count;
}

Result<AccessList> read_access_list(const std::string& path) {
  const auto text = read_file(path);
  if (!text.ok()) return text.status();
  return AccessList::parse(*text, path);
}

std::string time_text(std::int64_t seconds) {
  const std::time_t time = seconds;
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

std::optional<std::int64_t> time_of(std::string_view text) {
  std::tm utc{};
  const std::string copy(text);
  const char* end = strptime(copy.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  if (!end || *end != '\0') return std::nullopt;
  const std::int64_t seconds = timegm(&utc);
  // Refuses other spellings of a time ("2027-1-1T0:0:0Z"), and days that do not exist.
  return time_text(seconds) == text ? std::optional(seconds) : std::nullopt;
}

}  // namespace relmap::access
