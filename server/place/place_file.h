// The file of place blocks, DIR/places/blocks: block after block, each with its length and CRC32C. The file can be made
// again from the map, so it is not synced; a block that did not reach the disk whole is found by its checksum.
//
//    0  u8[8]  "RELMAPPL"
//    8  u32    version
//   12  u32    CRC of the vocabulary file
//   16  blocks: u32 number of bytes, u32 CRC32C of the bytes, the bytes (place_block.h)
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/random_file.h"

namespace relmap::place {

// One thread may write while any number read blocks that have been written.
class PlaceFile {
 public:
  static constexpr std::uint32_t kVersion = 2;

  // DIR/places, which holds only this file.
  static std::string folder_in(const std::string& data_folder) { return data_folder + "/places"; }

  // Opens the file in `data_folder`, which must exist, or creates it. IO_ERROR, DISK_FULL. If the file cannot be used
  // (WRONG_VOCABULARY, UNKNOWN_FORMAT_VERSION, CORRUPT), it is emptied and `emptied` is set to the reason.
  static Result<std::unique_ptr<PlaceFile>> open(const std::string& data_folder, std::uint32_t vocabulary_crc,
                                                 Status* emptied);

  struct Extent {
    std::uint64_t offset = 0;  // of the block's bytes, behind length and checksum
    std::uint32_t size = 0, crc = 0;
    std::uint64_t end() const { return offset + size; }
  };
  static constexpr std::uint64_t kBegin = 16;

  // Reads the block whose header is at `offset`. NO_SUCH_FILE at the end of the file, TRUNCATED, DATA_LOSS (the
  // checksum does not fit), IO_ERROR.
  Result<Extent> read_next(std::uint64_t offset, Bytes& bytes) const;
  // Reads the block of an extent that read_next() or write() returned. IO_ERROR, DATA_LOSS.
  Status read(const Extent& extent, Bytes& bytes) const;

  // Cuts the file at `offset` and appends a block there. IO_ERROR, DISK_FULL: the file ends at `offset` then.
  Result<Extent> write(std::uint64_t offset, ByteSpan bytes);
  // Truncates the file at `offset`.
  Status cut(std::uint64_t offset);

  const std::string& path() const { return file_->path(); }

 private:
  explicit PlaceFile(std::unique_ptr<storage::RandomFile> file) : file_(std::move(file)) {}

  const std::unique_ptr<storage::RandomFile> file_;
};

}  // namespace relmap::place
