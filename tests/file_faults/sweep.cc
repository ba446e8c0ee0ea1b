#include "tests/file_faults/sweep.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "storage/testing/temporary_folder.h"

namespace relmap::testing {

namespace {

namespace fs = std::filesystem;

// In memory where possible: thousands of disks are laid out, and how slow the real one is does not matter.
class Folder {
 public:
  Folder() {
    const std::string parent = ::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : fs::temp_directory_path().string();
    path_ = parent + "/relmap-test-XXXXXX";
    if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no folder can be made in " + parent);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

void promise(bool kept, const std::string& what) {
  if (!kept) throw BrokenPromise(what);
}

std::string SweepResult::summary() const {
  std::string text = std::to_string(operations) + " operations, " + std::to_string(states) + " states, " +
                     std::to_string(wrong.size()) + " wrong";
  for (const std::string& one : wrong) text += "\n  " + one;
  return text;
}

SweepResult fail_power_during(DiskModel disk, const std::vector<FileOperation>& operations, const Thoroughness& how,
                              const std::function<void(const LeftDisk&)>& check, std::size_t most) {
  SweepResult result;
  result.operations = static_cast<std::size_t>(std::count_if(operations.begin(), operations.end(), changes_disk));
  const std::size_t moments = how.moments == 0 ? result.operations : std::min(how.moments, result.operations);
  std::size_t done = 0, chosen = 0;
  for (std::size_t i = 0; i < operations.size() && result.wrong.size() < most; ++i) {
    disk.apply(operations[i]);
    if (!changes_disk(operations[i])) continue;
    ++done;
    if (done * moments / result.operations == chosen) continue;  // the last operation is always among them
    ++chosen;
    // What follows without changing the disk makes no difference to it: an end that was reached, or an acknowledgement
    // that was given after a file was closed, counts.
    std::size_t through = i + 1;
    while (through < operations.size() && !changes_disk(operations[through])) ++through;
    for (int seed = 0; seed <= how.seeds; ++seed) {
      const Folder folder;
      const LeftDisk left{folder.path() + "/disk", through, through == operations.size(), result.states};
      const std::uint64_t chance = done * 1000 + static_cast<std::uint64_t>(seed);
      try {
        disk.lay_out(left.root, seed == 0 ? Survives::kDurable : Survives::kSome, chance);
        check(left);
      } catch (const std::exception& error) {
        result.wrong.push_back("after operation " + std::to_string(i + 1) + " (" + to_string(operations[i]) + "), " +
                               (seed == 0 ? "what is durable" : "by chance " + std::to_string(chance)) + ": " +
                               error.what());
      }
      ++result.states;
    }
  }
  return result;
}

}  // namespace relmap::testing
