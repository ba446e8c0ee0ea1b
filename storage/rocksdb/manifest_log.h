// The log in which RocksDB lists the files of a store (MANIFEST), as far as salvage and a start after a power failure
// have to read and change it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/base/bytes.h"

namespace relmap::storage {

// The records of a log, up to the first byte that cannot be one. Checksums are not compared: salvage reads logs that
// RocksDB has just written.
std::vector<Bytes> read_log(ByteSpan log);
// The length of a log without its last record, if that is torn: if its checksum is wrong, it is the last, and some
// sector of 512 bytes holds nothing but zeros of it, as one that a power failure kept from being written. Otherwise the
// length of the log: what a flipped bit spoils is no torn end.
std::size_t length_without_torn_end(ByteSpan log);
// Appends a record to a log that begins with `w`.
void put_log_record(ByteWriter& w, ByteSpan record);

// A blob file, as a MANIFEST lists it.
struct BlobFile {
  std::uint64_t number = 0;  // in its name
  std::uint64_t count = 1;   // of values; matters to garbage collection only
  std::uint64_t bytes = 1;   // of values
  std::uint32_t family = 0;
};
inline constexpr std::size_t kBlobHeader = 30, kBlobFooter = 32;

// nullopt if a blob file is not called so. `header` and `footer` are the first and the last bytes of a file of `size`
// bytes, or fewer if it is shorter.
std::optional<BlobFile> blob_file(std::string_view stem, std::uint64_t size, ByteSpan header, ByteSpan footer);

// The MANIFEST with these blob files put in front of the tables that refer to them.
Bytes with_blob_files(ByteSpan manifest, std::span<const BlobFile> blobs);

}  // namespace relmap::storage
