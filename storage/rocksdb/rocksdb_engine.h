// The engine of a data folder: RocksDB for what is committed, our own log for the journal
// (storage/journal/journal_log.h).
//
//   DIR/FORMAT    the format version, one line of text
//   DIR/LOCK      held by the process that owns the folder
//   DIR/journal/  segments of the journal
//   DIR/map/      RocksDB
//   DIR/HASH      in a backup: the hash of its map
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "storage/engine/engine.h"
#include "storage/io/disk_space.h"

namespace rocksdb {
class FileSystem;
}

namespace relmap::storage {

class FileSystem;

struct RocksDbOptions {
  // One cache for blocks, index and filter blocks, table readers, blobs and memtables.
  std::size_t cache_bytes = std::size_t{64} << 20;
  bool read_only = false;  // nothing of the map is written; the folder is locked all the same
  // If the folder cannot be opened otherwise, opens it as if `read_only`; acquire() then says why (DATA_LOSS, IO_ERROR,
  // DISK_FULL, READ_ONLY).
  bool or_read_only = false;
  bool locked = false;  // the caller holds the folder's lock, for as long as the engine is open
  DiskSpaceOptions space;
  int format = 0;  // of the folder; 0: that of this build. An older one is opened only to be read and migrated
  // False only in the test which shows that durability is tested: then syncs of journal and commits do nothing.
  bool sync = true;
  // By which what was deleted is off the disk in time (reclaimer.h); tests have their own.
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
  // Direct I/O for reads and compactions, where the file system has it.
  bool direct_io = true;
  // The file systems under the journal and RocksDB, and that in which DIR and DIR/map are created; null: the machine's
  // own. For tests that forget what was not synced.
  std::shared_ptr<FileSystem> journal_files, folder_files;
  std::shared_ptr<rocksdb::FileSystem> map_files;
};

// Whether a folder can be opened as a map or become one, judging by the names in it. Writes nothing. NOT_A_MAP: it is
// neither empty nor a map's; UNKNOWN_FORMAT_VERSION, IO_ERROR.
Status check_data_folder(const std::string& directory);

// Opens the map in `directory`, or makes a new one. NOT_A_MAP, FOLDER_LOCKED, UNKNOWN_FORMAT_VERSION, IO_ERROR,
// DISK_FULL, READ_ONLY (a read-only file system), DATA_LOSS (RocksDB's own files); NO_SUCH_FILE if `read_only` and
// there is no map. A map whose journal has lost records opens: read_journal() and append() then answer DATA_LOSS,
// naming the range.
Result<std::shared_ptr<Engine>> open_rocksdb(const std::string& directory, RocksDbOptions options = {});

}  // namespace relmap::storage
