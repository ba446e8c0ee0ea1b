#include "tests/file_faults/traced_program.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <new>
#include <stdexcept>

#include "tests/support/process.h"

namespace relmap::testing {

namespace fs = std::filesystem;

FileFaults::FileFaults(const std::string& root, const std::string& notes, Recording recording)
    : root_(fs::canonical(root).string()), notes_(notes), recording_(recording) {
  fs::create_directories(notes_);
  std::ofstream(notes_ + "/control", std::ios::binary) << std::string(sizeof(FaultControl), '\0');
  const int fd = ::open((notes_ + "/control").c_str(), O_RDWR | O_CLOEXEC);
  void* const mapped =
      fd < 0 ? MAP_FAILED : ::mmap(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (fd >= 0) ::close(fd);
  if (mapped == MAP_FAILED) throw std::runtime_error("cannot map " + notes_ + "/control");
  control_ = new (mapped) FaultControl;
  if (recording_ == Recording::kOn) std::ofstream(notes_ + "/trace");
}

FileFaults::~FileFaults() { ::munmap(control_, sizeof(FaultControl)); }

std::vector<std::string> FileFaults::environment() const {
  std::vector<std::string> variables{"LD_PRELOAD=" + built_program("../tests/librelmap_file_faults.so"),
                                     std::string(kFaultRoot) + "=" + root_,
                                     std::string(kFaultControl) + "=" + notes_ + "/control"};
  if (recording_ == Recording::kOn) variables.push_back(std::string(kFaultTrace) + "=" + notes_ + "/trace");
  return variables;
}

void FileFaults::fail(FaultKind kind, std::uint64_t n, int error, std::chrono::milliseconds hang) {
  control_->error = error;
  control_->hang_ms = static_cast<std::uint32_t>(hang.count());
  control_->failing[static_cast<std::size_t>(kind)] = n;
}

void FileFaults::fail_from_now_on(FaultKind kind, int error, std::chrono::milliseconds hang) {
  control_->lasting = 1;
  fail(kind, 1, error, hang);
}

void FileFaults::mend() {
  for (auto& failing : control_->failing) failing = 0;
  control_->lasting = 0;
}

std::vector<FileOperation> FileFaults::operations() const { return read_trace(notes_ + "/trace"); }

}  // namespace relmap::testing
