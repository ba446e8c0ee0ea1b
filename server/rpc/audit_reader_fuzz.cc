// Reads the files of an audit log page by page. The first bytes say how many files there are, how large pages are and
// what is asked for; the rest are the files. However pages are cut, they give the same entries, and they end.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/testing/fuzzing.h"
#include "server/rpc/audit_reader.h"

namespace {

using namespace relmap;
using fuzzing::must;

class BytesAsFile final : public storage::ReadFile {
 public:
  explicit BytesAsFile(Bytes bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<Bytes> read(std::uint64_t offset, std::size_t size) const override {
    must(offset + size <= bytes_.size(), "a read beyond the end of a file");
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(offset);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
  }

 private:
  const Bytes bytes_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteReader in(ByteSpan(data, size));
  const std::size_t count = 1 + in.get<std::uint8_t>() % 3;
  const std::size_t page = 1 + in.get<std::uint8_t>() % 7;
  const auto asked = in.get<std::uint8_t>();
  rpc::AuditQuery query;
  if (asked & 1) query.who = "anna";
  if (asked & 2) query.method = "Map.SetLabel";
  query.failed = asked & 4;
  if (asked & 8) query.from_us = 1'772'600'767'000'000;
  if (asked & 16) query.until_us = 1'772'600'768'000'000;
  std::vector<std::unique_ptr<storage::ReadFile>> files;
  for (std::size_t i = 0; i < count; ++i) {
    const ByteSpan part =
        fuzzing::take_up_to(in, i + 1 == count ? in.remaining() : std::size_t{in.get<std::uint16_t>()});
    if (!part.empty()) files.push_back(std::make_unique<BytesAsFile>(Bytes(part.begin(), part.end())));
  }
  if (asked & 32) {  // any token
    query.token = fuzzing::text_of(ByteSpan(data, std::min<std::size_t>(size, 24)));
    const auto any = rpc::read_audit(files, query, [] { return Status(); });
    must(any.ok() || fuzzing::is_one_of(any.reason(), {Reason::INVALID_ARGUMENT, Reason::VIEW_EXPIRED}));
    query.token.clear();
  }
  const auto all = [&](std::size_t most, std::uint64_t bytes) {
    std::vector<std::string> entries;
    query.max_entries = most;
    for (std::size_t pages = 0; pages <= size + 4; ++pages) {
      const auto read = rpc::read_audit(
          files, query, [] { return Status(); }, bytes);
      // Two files that begin with the same line are one for a token.
      must(read.ok() && read->entries.size() <= most, "a page is refused, or too long");
      for (const rpc::AuditRead& entry : read->entries) {
        must(entry.outcome != Reason::OK || !query.failed, "an entry that was not asked for");
        entries.push_back(entry.method + " " + entry.request + " " + std::to_string(entry.time_us));
      }
      if (read->next.empty()) {
        query.token.clear();
        return entries;
      }
      if (read->next == query.token) break;
      query.token = read->next;
    }
    query.token.clear();
    return std::vector<std::string>{"endless"};
  };
  const auto whole = all(size + 1, size + 1);
  must(whole.empty() || whole[0] != "endless", "one page has no end");
  bool differ = true;  // in what they begin with
  for (std::size_t i = 0; i < files.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto first_line = [](const storage::ReadFile& file) {
        Bytes bytes = *file.read(0, std::min<std::size_t>(file.size(), 4096));
        bytes.resize(static_cast<std::size_t>(std::find(bytes.begin(), bytes.end(), '\n') - bytes.begin()));
        return bytes;
      };
      differ = differ && first_line(*files[i]) != first_line(*files[j]);
    }
  if (differ)
    must(all(page, size + 1) == whole && all(size + 1, 1 + page * 64) == whole, "pages differ from the whole");
  return 0;
}
