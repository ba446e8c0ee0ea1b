#include "storage/rocksdb/repair_folder.h"

#include <fcntl.h>
#include <stdio.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "storage/journal/journal_segment.h"
#include "storage/maintenance/journal_repair.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/salvage.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

// A file in a folder that is complete and may take the place of a damaged one. RocksDB and the journal ignore it. A
// folder that is left beside the map without this file is the damaged one, after the exchange.
constexpr const char* kComplete = "/COMPLETE";

Status io_error(const std::string& what) { return Status(Reason::IO_ERROR, what + ": " + std::strerror(errno)); }

class FolderRepair {
 public:
  FolderRepair(const std::string& directory, const RepairOptions& options, const OnFinding& on_finding,
               const OnProgress& on_progress)
      : directory_(directory),
        work_(directory + "/salvage"),
        quarantine_(directory + "/quarantine"),
        options_(options),
        on_finding_(on_finding),
        on_progress_(on_progress),
        files_(posix_file_system()) {}

  RepairSummary run() {
    if (!fs::is_directory(directory_ + "/map") && !fs::is_directory(directory_ + "/journal") && !fs::exists(work_))
      throw StatusError(Status(Reason::NO_SUCH_FILE, directory_ + " holds no map"));
    {
      const auto lock = FolderLock::take(directory_).or_throw();
      finish_interrupted();
      mend_format();
      salvage();
      mend_journal();
      std::error_code ignored;
      fs::remove_all(work_, ignored);
    }
    RepairSummary map = repair_map();
    map.changed = map.changed || changed_;
    map.salvaged = salvaged_;
    map.lost_records = std::move(lost_records_);
    // The place index may know frames that are gone, by this repair or one that was interrupted; the daemon makes it
    // again from the map.
    std::error_code ignored;
    fs::remove_all(directory_ + "/places", ignored);
    fs::remove_all(directory_ + "/routes", ignored);
    if (map.changed) fs::remove(directory_ + "/HASH", ignored);
    if (changed_) map.quarantine = quarantine_;
    return map;
  }

 private:
  void tell(Reason reason, const std::string& what) {
    changed_ = true;
    if (on_finding_) on_finding_({reason, {}, what, true});
  }

  void finish_interrupted() {
    for (const char* name : {"/map", "/journal"}) {
      const std::string other = work_ + name, own = directory_ + name;
      if (!fs::is_directory(other)) continue;
      const bool complete = fs::exists(other + kComplete);
      if (complete && !fs::is_directory(own))
        move(other, own);
      else if (!complete)
        keep(other, name + 1), tell(Reason::DATA_LOSS, "an interrupted repair left what was broken in " + other);
    }
    std::error_code error;
    fs::remove_all(work_, error);
    if (error) throw StatusError(Status(Reason::IO_ERROR, work_ + ": " + error.message()));
  }

  // Replaces a FORMAT that is missing or damaged: the parts themselves say their version too.
  void mend_format() {
    const std::string path = directory_ + "/FORMAT";
    std::string line;
    std::ifstream in(path);
    if (std::getline(in, line) && line.starts_with("relmap map ")) return throw_if(check_format(directory_, true));
    in.close();
    tell(Reason::DATA_LOSS, path + (fs::exists(path) ? " was damaged" : " was missing"));
    if (fs::exists(path)) keep(path, "FORMAT");
    throw_if(write_format(directory_, kFolderFormat));
  }

  void salvage() {
    const std::string map = directory_ + "/map";
    if (!fs::is_directory(map)) {
      if (new_journal()) return;
      throw StatusError(Status(Reason::DATA_LOSS, "nothing can be saved: " + map + " is missing"));
    }
    throw_if(files_->create_directory(work_));
    const std::string copy = work_ + "/map.partial";
    const auto result = salvage_store(map, work_ + "/files", copy, on_finding_, on_progress_).or_throw();
    if (result.sound) return;
    tell(Reason::DATA_LOSS, "the store was damaged: " + std::to_string(result.copied) + " keys were saved, " +
                                std::to_string(result.lost) + " that are known of were not");
    salvaged_ = true;
    exchange(copy, "/map");
  }
  // Whether the journal has every record that there ever was: then the daemon makes the map from it when it starts.
  bool new_journal() const {
    const auto names = files_->list(directory_ + "/journal");
    if (!names.ok() || names->empty()) return true;
    const auto first = SegmentName::parse(names->front());
    return first && first->first == 1;
  }

  void mend_journal() {
    if (!fs::is_directory(directory_ + "/map")) return;
    const StoreHead head = read_store_head(directory_ + "/map").or_throw();
    throw_if(files_->create_directory(work_));
    const std::string copy = work_ + "/journal.partial";
    auto result =
        repair_journal(files_, directory_ + "/journal", copy, head.applied, head.sessions, on_finding_, on_progress_)
            .or_throw();
    if (result.sound) return;
    changed_ = true;
    lost_records_ = std::move(result.lost);
    exchange(copy, "/journal");
  }

  // The copy takes the place of DIR/name in one step; what stood there goes to quarantine.
  void exchange(const std::string& copy, const std::string& name) {
    const std::string other = work_ + name, own = directory_ + name;
    auto mark = files_->open_append(copy + kComplete);
    throw_if(mark.status());
    throw_if((*mark)->sync());
    throw_if(files_->sync_directory(copy));
    move(copy, other);
    if (!fs::is_directory(own)) return move(other, own);
    if (::renameat2(AT_FDCWD, other.c_str(), AT_FDCWD, own.c_str(), RENAME_EXCHANGE) == 0) {
      throw_if(files_->sync_directory(work_));
      throw_if(files_->sync_directory(directory_));
      keep(other, name.substr(1));
    } else if (errno == EINVAL || errno == ENOSYS) {
      // The file system cannot exchange: finish_interrupted() and open_rocksdb() know of the two steps that this takes.
      keep(own, name.substr(1));
      move(other, own);
    } else {
      throw StatusError(io_error("exchanging " + own));
    }
    std::error_code ignored;
    fs::remove(own + kComplete, ignored);
  }
  void move(const std::string& from, const std::string& to) {
    if (::rename(from.c_str(), to.c_str()) != 0) throw StatusError(io_error("moving " + from));
    throw_if(files_->sync_directory(fs::path(to).parent_path()));
    throw_if(files_->sync_directory(fs::path(from).parent_path()));
  }
  void keep(const std::string& path, const std::string& name) {
    throw_if(create_durable_directory(*files_, quarantine_));
    std::string to = quarantine_ + "/" + name;
    for (int n = 2; fs::exists(to); ++n) to = quarantine_ + "/" + name + "." + std::to_string(n);
    changed_ = true;
    move(path, to);
  }

  // Opened for reading first: a sound map is not written to.
  RepairSummary repair_map() {
    RocksDbOptions how;
    how.read_only = true;
    if (fs::is_directory(directory_ + "/map")) {
      const auto engine = open_rocksdb(directory_, how).or_throw();
      auto sound = repair(engine, quarantine_, options_, on_finding_, on_progress_);
      if (sound.ok()) return *std::move(sound);
      if (sound.reason() != Reason::READ_ONLY) throw StatusError(sound.status());
    }
    how.read_only = false;
    return repair(open_rocksdb(directory_, how).or_throw(), quarantine_, options_, on_finding_, on_progress_)
        .or_throw();
  }

  const std::string directory_, work_, quarantine_;
  const RepairOptions& options_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  const std::shared_ptr<FileSystem> files_;
  bool changed_ = false, salvaged_ = false;
  std::vector<RecordRange> lost_records_;
};

}  // namespace

Result<RepairSummary> repair_folder(const std::string& directory, const RepairOptions& options,
                                    const OnFinding& on_finding, const OnProgress& on_progress) try {
  return FolderRepair(directory, options, on_finding, on_progress).run();
} catch (const StatusError& error) {
  return error.status();
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
}

}  // namespace relmap::storage
