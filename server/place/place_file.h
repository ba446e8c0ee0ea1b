// Blocks of places on disk, one after another, each with length and CRC32C: DIR/places/blocks. All of it can be made
// again from the map, so nothing is synced: what did not reach the disk whole is found by its checksum.
//
//    0  u8[8]  "RELMAPPL"
//    8  u32    version
//   12  u32    CRC of the vocabulary file
//   16  blocks: u32 bytes, u32 CRC32C of them, the bytes (place_block.h)
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/random_file.h"

namespace relmap::place {

// One thread writes, any number read what stands there.
class PlaceFile {
 public:
  static constexpr std::uint32_t kVersion = 2;

  // DIR/places, which holds nothing else.
  static std::string folder_in(const std::string& data_folder) { return data_folder + "/places"; }

  // The file in `data_folder`, which must exist; made if it is not there. IO_ERROR, DISK_FULL. `emptied` says why a
  // file that was there is of no use (WRONG_VOCABULARY, UNKNOWN_FORMAT_VERSION, CORRUPT); it is empty then.
  static Result<std::unique_ptr<PlaceFile>> open(const std::string& data_folder, std::uint32_t vocabulary_crc,
                                                 Status* emptied);

  struct Extent {
    std::uint64_t offset = 0;  // of the bytes
    std::uint32_t size = 0, crc = 0;
    std::uint64_t end() const { return offset + size; }
  };
  static constexpr std::uint64_t kBegin = 16;

  // The block that stands at `offset`: NO_SUCH_FILE at the end of the file, TRUNCATED, CORRUPT (`bytes` are not those
  // that were written), IO_ERROR.
  Result<Extent> read_next(std::uint64_t offset, Bytes& bytes) const;
  // The block of an extent that read_next() or write() gave. IO_ERROR, DATA_LOSS.
  Status read(const Extent& extent, Bytes& bytes) const;

  // At `offset`, in the place of all that stands from there on. IO_ERROR, DISK_FULL: nothing stands there then.
  Result<Extent> write(std::uint64_t offset, ByteSpan bytes);
  Status cut(std::uint64_t offset);

  const std::string& path() const { return file_->path(); }

 private:
  explicit PlaceFile(std::unique_ptr<storage::RandomFile> file) : file_(std::move(file)) {}

  const std::unique_ptr<storage::RandomFile> file_;
};

}  // namespace relmap::place
