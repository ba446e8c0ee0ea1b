#include "tools/bench/ride_drive.h"

#include <chrono>
#include <utility>

#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/tracking/tracker.h"
#include "proto/base/crc32c.h"
#include "storage/engine/memory_engine.h"
#include "tools/bench/picture_drive.h"

namespace relmap::bench {

namespace {

constexpr int kAppearanceFeatures = 300;  // of a keyframe's appearance set, as relmap-frontend has them

SessionHeader header_of(const sim::PictureWorldOptions& options) {
  SessionHeader header;
  header.uuid.bytes[0] = 1;
  header.uuid.bytes[1] = static_cast<std::uint8_t>(options.seed);
  header.robot = header.name = "rider";
  header.camera = options.camera;
  return header;
}

}  // namespace

RideDrive drive_ride(const sim::PictureWorldOptions& options) {
  const auto pictures = open_rendered_drive(options);
  const sim::PictureWorld world(options);
  tracking::StereoTracker tracker(header_of(options));
  RideDrive drive;
  for (int i = 0; auto pair = pictures->next(); ++i) {
    const auto prepared = tracking::prepare_pair(std::move(pair->pictures.left), pair->pictures.right);
    auto keyframe = tracker.feed(prepared, pair->pictures.time_us).or_throw();
    ++drive.pairs;
    drive.lost += !tracker.report().tracked && !tracker.report().repeated;
    if (!keyframe) continue;
    keyframe->appearance =
        tracking::appearance_set(*prepared, *keyframe, tracker.report().offset_px, kAppearanceFeatures);
    keyframe->picture = tracking::keyframe_picture(prepared->picture, tracking::KeyframePicture::kWhole);
    drive.keyframes.push_back(std::move(*keyframe));
    drive.truth.push_back(pair->truth);
    drive.riding.push_back(world.riding(i));
    drive.carried.push_back(world.carried(i));
  }
  return drive;
}

std::unique_ptr<map::Mapper> begin_ride(const RideDrive& drive, bool closures) {
  map::MapperOptions options;
  options.deterministic = true;
  options.closures = closures;
  auto mapper =
      map::Mapper::open(storage::make_memory_engine(), std::make_shared<storage::Budget>(std::size_t{2} << 30),
                        place::Vocabulary::load(place::default_vocabulary_path()).or_throw(), options)
          .or_throw();
  mapper->begin_session(drive.keyframes.front().session).or_throw();
  return mapper;
}

void take_in(const RideDrive& drive, std::size_t i, map::Mapper& mapper) {
  constexpr SessionNumber kSession = 1;  // the first
  Bytes payload = encode_keyframe(drive.keyframes[i]);
  const std::uint32_t crc = crc32c(payload);
  mapper.submit_and_wait(storage::KeyframeRecord{kSession, crc, std::move(payload)}).or_throw();
}

std::unique_ptr<map::Mapper> map_ride(const RideDrive& drive, bool closures) {
  auto mapper = begin_ride(drive, closures);
  for (std::size_t i = 0; i < drive.keyframes.size(); ++i) take_in(drive, i, *mapper);
  const Status idle = mapper->wait_idle(std::chrono::steady_clock::now() + std::chrono::minutes(10));
  if (!idle.ok()) throw StatusError(idle);
  return mapper;
}

}  // namespace relmap::bench
