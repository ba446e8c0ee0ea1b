#include "server/place/posting_segment.h"

#include "proto/crc32c.h"

namespace relmap {
namespace {

constexpr std::size_t kWriteBytes = 256 * 1024;

template <typename T>
ByteSpan bytes_of(std::span<const T> values) {
  return {reinterpret_cast<const std::uint8_t*>(values.data()), values.size_bytes()};
}

[[noreturn]] void damaged(const std::string& what) {
  throw StatusError(Status(Reason::DATA_LOSS, "the paged part of the place index is damaged: " + what));
}

}  // namespace

// The lists one after another, each with its CRC32C behind it; then where each begins, and the last ends.
Result<std::shared_ptr<const PostingSegment>> PostingSegment::write(const std::string& folder, std::uint32_t words,
                                                                    std::uint32_t first, std::uint32_t places,
                                                                    const Lists& list) {
  auto file = SpillFile::create(folder);
  if (!file.ok()) return file.status();
  std::vector<std::uint64_t> directory;
  directory.reserve(words + std::size_t{1});
  Bytes buffer;
  buffer.reserve(2 * kWriteBytes);
  const auto flush = [&](std::size_t beyond) -> Status {
    if (buffer.size() <= beyond) return {};
    const Status status = (*file)->append(buffer);
    buffer.clear();
    return status;
  };
  for (std::uint32_t word = 0; word < words; ++word) {
    const auto places_of_word = list(word);
    if (!places_of_word.ok()) return places_of_word.status();
    directory.push_back((*file)->size() + buffer.size());
    const ByteSpan bytes = bytes_of(*places_of_word);
    const std::uint32_t crc = crc32c(bytes);
    buffer.insert(buffer.end(), bytes.begin(), bytes.end());
    const ByteSpan crc_bytes = bytes_of(std::span<const std::uint32_t>(&crc, 1));
    buffer.insert(buffer.end(), crc_bytes.begin(), crc_bytes.end());
    if (Status status = flush(kWriteBytes); !status.ok()) return status;
  }
  if (Status status = flush(0); !status.ok()) return status;
  directory.push_back((*file)->size());

  std::shared_ptr<PostingSegment> segment(new PostingSegment());
  segment->words_ = words;
  segment->first_ = first;
  segment->places_ = places;
  segment->directory_at_ = (*file)->size();
  const ByteSpan directory_bytes = bytes_of(std::span<const std::uint64_t>(directory));
  segment->directory_crc_ = crc32c(directory_bytes);
  if (Status status = (*file)->append(directory_bytes); !status.ok()) return status;
  segment->file_ = std::move(file).value();
  return std::shared_ptr<const PostingSegment>(std::move(segment));
}

Result<std::shared_ptr<const PostingSegment>> PostingSegment::merge(const std::string& folder,
                                                                    const PostingSegment& older,
                                                                    const PostingSegment& newer) try {
  Reader first(older), second(newer);
  std::vector<std::uint32_t> both;
  return write(folder, older.words_, older.first_, older.places_ + newer.places_,
               [&](std::uint32_t word) -> Result<std::span<const std::uint32_t>> {
                 const auto head = first.list(word), tail = second.list(word);
                 both.assign(head.begin(), head.end());
                 both.insert(both.end(), tail.begin(), tail.end());
                 return std::span<const std::uint32_t>(both);
               });
} catch (const StatusError& error) {
  return error.status();
}

PostingSegment::Reader::Reader(const PostingSegment& segment)
    : segment_(segment), directory_(segment.words_ + std::size_t{1}) {
  const std::size_t bytes = directory_.size() * sizeof(directory_[0]);
  if (Status status = segment.file_->read(segment.directory_at_, directory_.data(), bytes); !status.ok())
    throw StatusError(status);
  if (crc32c(bytes_of(std::span<const std::uint64_t>(directory_))) != segment.directory_crc_) damaged("its directory");
}

std::span<const std::uint32_t> PostingSegment::Reader::list(std::uint32_t word) {
  const std::uint64_t begin = directory_[word], end = directory_[word + std::size_t{1}];
  list_.resize((end - begin) / sizeof(list_[0]));
  if (Status status = segment_.file_->read(begin, list_.data(), end - begin); !status.ok()) throw StatusError(status);
  const std::uint32_t crc = list_.back();
  list_.pop_back();
  if (crc32c(bytes_of(std::span<const std::uint32_t>(list_))) != crc)
    damaged("the list of word " + std::to_string(word));
  return list_;
}

}  // namespace relmap
