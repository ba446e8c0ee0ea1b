#include "server/place/place_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "proto/crc32c.h"

namespace relmap {
namespace {

constexpr char kMagic[] = "RELMAPPL";
constexpr std::uint32_t kFrameBytes = 8;        // before a block
constexpr std::uint32_t kMostBytes = 1u << 30;  // of a block, by far

Status check_header(const Bytes& header, std::uint32_t vocabulary_crc, const std::string& path) {
  ByteReader r(header);
  const ByteSpan magic = r.get_bytes(8);
  const auto version = r.get<std::uint32_t>();
  const auto crc = r.get<std::uint32_t>();
  if (std::memcmp(magic.data(), kMagic, 8) != 0) return {Reason::CORRUPT, path + " is no place index"};
  if (version != PlaceFile::kVersion)
    return {Reason::UNKNOWN_FORMAT_VERSION, path + " is of version " + std::to_string(version)};
  if (crc != vocabulary_crc)
    return {Reason::WRONG_VOCABULARY, path + " was made with another vocabulary (crc " + std::to_string(crc) +
                                          ", given " + std::to_string(vocabulary_crc) + ")"};
  return {};
}

}  // namespace

Result<std::unique_ptr<PlaceFile>> PlaceFile::open(const std::string& data_folder, std::uint32_t vocabulary_crc,
                                                   Status* emptied) {
  const std::string folder = folder_in(data_folder);
  const auto error = [](const std::string& what) {
    return Status(errno == ENOSPC || errno == EDQUOT ? Reason::DISK_FULL : Reason::IO_ERROR,
                  what + ": " + std::strerror(errno));
  };
  if (::mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) return error("creation of folder " + folder);
  const std::string path = folder + "/blocks";
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) return error("opening of " + path);
  std::unique_ptr<PlaceFile> file(new PlaceFile(fd, path));

  Bytes header(kBegin);
  Status good = file->read_at(0, header.data(), header.size());
  if (good.ok()) good = check_header(header, vocabulary_crc, path);
  if (good.ok()) return file;
  if (good.reason() == Reason::IO_ERROR) return good;
  if (good.reason() != Reason::TRUNCATED) *emptied = good;
  ByteWriter w;
  w.put_bytes(as_bytes(kMagic));
  w.put(kVersion);
  w.put(vocabulary_crc);
  if (Status cut = file->cut(0); !cut.ok()) return cut;
  if (Status written = file->write_at(0, w.bytes()); !written.ok()) return written;
  return file;
}

PlaceFile::~PlaceFile() { ::close(fd_); }

Result<PlaceFile::Extent> PlaceFile::read_next(std::uint64_t offset, Bytes& bytes) const {
  struct stat info {};
  if (::fstat(fd_, &info) != 0) return failed("size of");
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (offset == size) return {Reason::NO_SUCH_FILE, "the end of " + path_};
  std::uint32_t frame[2];
  if (Status read = read_at(offset, frame, sizeof frame); !read.ok()) return read;
  const Extent extent{offset + kFrameBytes, frame[0], frame[1]};
  if (extent.size > kMostBytes || extent.end() > size)
    return {Reason::TRUNCATED, path_ + " ends within the block at byte " + std::to_string(offset)};
  if (Status whole = read(extent, bytes); !whole.ok()) return whole;
  return extent;
}

Status PlaceFile::read(const Extent& extent, Bytes& bytes) const {
  bytes.resize(extent.size);
  if (Status read = read_at(extent.offset, bytes.data(), bytes.size()); !read.ok()) return read;
  if (crc32c(bytes) != extent.crc)
    return {Reason::DATA_LOSS, "the block of places at byte " + std::to_string(extent.offset) + " of " + path_ +
                                   " is damaged; a start makes it again from the map"};
  return {};
}

Result<PlaceFile::Extent> PlaceFile::write(std::uint64_t offset, ByteSpan bytes) {
  const Extent extent{offset + kFrameBytes, static_cast<std::uint32_t>(bytes.size()), crc32c(bytes)};
  const std::uint32_t frame[2] = {extent.size, extent.crc};
  Status written = cut(offset);
  if (written.ok()) written = write_at(offset, {reinterpret_cast<const std::uint8_t*>(frame), sizeof frame});
  if (written.ok()) written = write_at(extent.offset, bytes);
  if (written.ok()) return extent;
  (void)cut(offset);
  return written;
}

Status PlaceFile::cut(std::uint64_t offset) {
  if (::ftruncate(fd_, static_cast<off_t>(offset)) != 0) return failed("truncation of");
  return {};
}

Status PlaceFile::failed(const char* what) const {
  return {errno == ENOSPC || errno == EDQUOT ? Reason::DISK_FULL : Reason::IO_ERROR,
          std::string(what) + ' ' + path_ + ": " + std::strerror(errno)};
}

Status PlaceFile::write_at(std::uint64_t offset, ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed("write to");
    offset += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Status PlaceFile::read_at(std::uint64_t offset, void* bytes, std::size_t count) const {
  auto* out = static_cast<std::uint8_t*>(bytes);
  while (count > 0) {
    const ssize_t got = ::pread(fd_, out, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failed("read of");
    if (got == 0) return {Reason::TRUNCATED, path_ + " ends at byte " + std::to_string(offset)};
    out += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return {};
}

}  // namespace relmap
