#include "server/place/place_file.h"

#include <cstring>

#include "proto/base/crc32c.h"
#include "storage/io/file.h"

namespace relmap::place {
namespace {

constexpr char kPlaceFileMagic[] = "RELMAPPL";
constexpr std::uint32_t kFrameBytes = 8;            // length and checksum before a block
constexpr std::uint32_t kMaxBlockBytes = 1u << 30;  // far more than any block has

Status check_header(const Bytes& header, std::uint32_t vocabulary_crc, const std::string& path) {
  ByteReader r(header);
  const ByteSpan magic = r.get_bytes(8);
  const auto version = r.get<std::uint32_t>();
  const auto crc = r.get<std::uint32_t>();
  if (std::memcmp(magic.data(), kPlaceFileMagic, 8) != 0) return {Reason::CORRUPT, path + " is not a place index"};
  if (version != PlaceFile::kVersion)
    return {Reason::UNKNOWN_FORMAT_VERSION,
            path + " has version " + std::to_string(version) + ", known: " + std::to_string(PlaceFile::kVersion)};
  if (crc != vocabulary_crc)
    return {Reason::WRONG_VOCABULARY, path + " was made with another vocabulary (crc " + std::to_string(crc) +
                                          ", given " + std::to_string(vocabulary_crc) + ")"};
  return {};
}

}  // namespace

Result<std::unique_ptr<PlaceFile>> PlaceFile::open(const std::string& data_folder, std::uint32_t vocabulary_crc,
                                                   Status* emptied) {
  const std::string folder = folder_in(data_folder);
  if (Status made = storage::posix_file_system()->create_directory(folder); !made.ok())
    return {made.reason() == Reason::DISK_FULL ? Reason::DISK_FULL : Reason::IO_ERROR, made.message()};
  auto opened = storage::RandomFile::open(folder + "/blocks");
  if (!opened.ok()) return opened.status();
  std::unique_ptr<PlaceFile> file(new PlaceFile(std::move(opened).value()));

  Bytes header(kBegin);
  Status good = file->file_->read(0, header.data(), header.size());
  if (good.ok()) good = check_header(header, vocabulary_crc, file->path());
  if (good.ok()) return file;
  if (good.reason() == Reason::IO_ERROR) return good;
  if (good.reason() != Reason::TRUNCATED) *emptied = good;
  ByteWriter w;
  w.put_bytes(as_bytes(kPlaceFileMagic));
  w.put(kVersion);
  w.put(vocabulary_crc);
  if (Status cut = file->cut(0); !cut.ok()) return cut;
  if (Status written = file->file_->write(0, w.bytes()); !written.ok()) return written;
  return file;
}

Result<PlaceFile::Extent> PlaceFile::read_next(std::uint64_t offset, Bytes& bytes) const {
  const auto size = file_->size();
  if (!size.ok()) return size.status();
  if (offset == *size) return {Reason::NO_SUCH_FILE, "the end of " + path()};
  std::uint32_t frame[2];
  if (Status read = file_->read(offset, frame, sizeof frame); !read.ok()) return read;
  const Extent extent{offset + kFrameBytes, frame[0], frame[1]};
  if (extent.size > kMaxBlockBytes || extent.end() > *size)
    return {Reason::TRUNCATED, path() + " ends within the block at byte " + std::to_string(offset)};
  if (Status whole = read(extent, bytes); !whole.ok()) return whole;
  return extent;
}

Status PlaceFile::read(const Extent& extent, Bytes& bytes) const {
  bytes.resize(extent.size);
  if (Status read = file_->read(extent.offset, bytes.data(), bytes.size()); !read.ok()) return read;
  if (crc32c(bytes) != extent.crc)
    return {Reason::DATA_LOSS, "the block of places at byte " + std::to_string(extent.offset) + " of " + path() +
                                   " is damaged; the next start makes it again from the map"};
  return {};
}

Result<PlaceFile::Extent> PlaceFile::write(std::uint64_t offset, ByteSpan bytes) {
  const Extent extent{offset + kFrameBytes, static_cast<std::uint32_t>(bytes.size()), crc32c(bytes)};
  const std::uint32_t frame[2] = {extent.size, extent.crc};
  Status written = cut(offset);
  if (written.ok()) written = file_->write(offset, {reinterpret_cast<const std::uint8_t*>(frame), sizeof frame});
  if (written.ok()) written = file_->write(extent.offset, bytes);
  if (written.ok()) return extent;
  (void)cut(offset);
  return written;
}

Status PlaceFile::cut(std::uint64_t offset) { return file_->truncate(offset); }

}  // namespace relmap::place
