#include "storage/maintenance/quarantine.h"

namespace relmap::storage {

Status Quarantine::keep(const std::string& name, ByteSpan bytes) {
  if (Status made = create_durable_directory(*files_, directory_); !made.ok()) return made;
  used_ = true;
  std::string path = directory_ + "/" + name;
  for (int n = 2; files_->open_read(path).ok(); ++n) path = directory_ + "/" + name + "." + std::to_string(n);
  auto file = files_->open_append(path);
  if (!file.ok()) return file.status();
  if (Status appended = (*file)->append(bytes); !appended.ok()) return appended;
  if (Status synced = (*file)->sync(); !synced.ok()) return synced;
  return files_->sync_directory(directory_);
}

}  // namespace relmap::storage
