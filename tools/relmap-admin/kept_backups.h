// The backups of a map that `relmap-admin backup --keep` makes in one folder: how they are called, and which of them
// are removed when there are too many.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/ids.h"
#include "storage/io/open_folder.h"

namespace relmap::admin {

// "2026-11-30T12-00-00Z-1b4e28ba": when the backup was begun, UTC, and the first digits of the map's uuid. Names of one
// map sort by age.
std::string backup_name(std::int64_t time_s, const Uuid& map);

// The newest complete backup in a folder of such, of any map: its path. NO_SUCH_FILE: there is none.
Result<std::string> newest_backup(const std::string& folder);

class KeptBackups {
 public:
  // Makes the folder if it is missing. NOT_ALLOWED: it is not this user's alone, so that somebody else could put
  // something into it that is then removed. IO_ERROR.
  static Result<KeptBackups> open(const std::string& folder, const Uuid& map);

  // The path of the next backup. It sorts behind all that the map has here, also if the clock was set back.
  std::string next(std::int64_t now_s) const;

  // Removes the oldest backups of the map beyond the `keep` newest, and what interrupted backups and removals of it
  // left that are older than `newest`, a path of next(). `removed` is called with the path of each backup that is gone.
  // Anything else in the folder stays: other names, backups of other maps, links, and what another process uses. A
  // backup that is too many and cannot be removed is the status, after the others are: FOLDER_LOCKED; WRONG_MAP (it
  // holds another map than its name says); WRONG_STATE (its map has changed since it was made); DATA_LOSS (it cannot be
  // read); IO_ERROR.
  Status thin(std::size_t keep, const std::string& newest,
              const std::function<void(const std::string& path)>& removed) const;

 private:
  KeptBackups(std::string path, std::unique_ptr<storage::OpenFolder> folder, const Uuid& map)
      : path_(std::move(path)), folder_(std::move(folder)), map_(map) {}
  std::vector<std::string> names(const std::string& ending) const;  // of the map, ascending, without the ending
  Status remove(const std::string& name) const;
  Status clear(const std::string& removed_name) const;

  std::string path_;
  std::unique_ptr<storage::OpenFolder> folder_;
  Uuid map_;
};

}  // namespace relmap::admin
