#include <glad/gl.h>

#include <cstdint>
#include <file.hpp>
#include <image.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app.hpp"

// The images of the window and the reports that replay files request.
namespace cumulet::demo {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

void App::save_window(const std::string& path) {
  const auto [width, height] = window_->size();
  image::Image picture{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
  const std::size_t row = std::size_t{4} * picture.width;
  std::vector<std::uint8_t> bytes(row * picture.height);
  gl_->BindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  gl_->PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl_->ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
  picture.rgba.resize(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::size_t y = picture.height - 1 - i / row;
    picture.rgba[y * row + i % row] = image::srgb_decode(static_cast<float>(bytes[i]) / 255.0f);
  }
  image::PngOptions png;
  png.tone_mapping = image::ToneMapping::none;
  image::write_png(path, picture, png);
}

void App::write_report(const std::string& path) const {
  const Status& status = model_.status;
  const Rectangle& viewport = image_->viewport();
  Json json;
  json["frames"] = frames_.count;
  json["drawn_frames"] = frames_.drawn;
  json["idle_frames"] = replay_.player ? replay_.player->idle_frames() : 0;
  json["converged"] = (status.frame.flags & CUMULET_RENDER_CONVERGED) != 0;
  json["preview"] = (status.frame.flags & CUMULET_RENDER_PREVIEW) != 0;
  json["progress"] = status.frame.progress;
  json["picture"] = {status.frame.width, status.frame.height};
  json["viewport"] = {viewport.x, viewport.y, viewport.width, viewport.height};
  json["busy"] = status.busy;
  json["has_volume"] = status.has_volume;
  json["has_content"] = status.has_content;
  json["title"] = frames_.title;
  json["saving"] = status.saving;
  json["cells"] = status.stats.cells;
  json["cell_bytes"] = status.stats.cell_bytes;
  json["samples"] = status.stats.samples;
  json["noise"] = status.noise ? Json(*status.noise) : Json();
  json["undo_steps"] = history_->depth();
  json["frame_ms"] = model_.charts.frame_ms.values();
  json["picture_ms"] = model_.charts.picture_ms.values();
  json["compiled_percent"] = model_.charts.compiled_percent.values();
  json["device_ms"] = model_.charts.device_ms.values();
  json["pass_seconds"] = {
      {"upload", status.stats.pass_seconds_upload},     {"host_depth", status.stats.pass_seconds_host_depth},
      {"surfaces", status.stats.pass_seconds_surfaces}, {"trace", status.stats.pass_seconds_trace},
      {"inspect", status.stats.pass_seconds_inspect},   {"display", status.stats.pass_seconds_display}};
  json["pictures"] = frames_.pictures;
  json["grid"] = status.grid;
  if (status.play) {
    const auto& [sequence, row, info, states, failure] = *status.play;
    json["sequence"] = {{"frame", row.number(info.requested_frame)},
                        {"drawn", info.is_displayed != 0 ? Json(row.number(info.displayed_frame)) : Json()},
                        {"first", row.number(0)},
                        {"count", row.count()},
                        {"ready", info.ready_frames},
                        {"failed", info.failed_frames},
                        {"failure", failure},
                        {"playing", model_.playing},
                        {"clock", model_.clock}};
    const SceneSequence& given = model_.scene.sequence;
    json["sequence"]["first_played"] = given.first ? Json(*given.first) : Json();
    json["sequence"]["last_played"] = given.last ? Json(*given.last) : Json();
    json["sequence"]["frames_per_second"] = given.playback.frames_per_second;
    json["sequence"]["repeat"] = static_cast<int>(given.playback.repeat);
  }
  json["neighbours"] = status.neighbours ? status.neighbours->count() : 0;
  json["state"] = frames_.state;
  json["modified"] = model_.modified;
  json["question"] = panel_.question().is_open() ? Json(panel_.question().title()) : Json();
  json["dialog"] = panel_.dialog_open();
  json["recent"] = model_.preferences.recent;
  json["messages"] = Json::array();
  for (const Message& message : model_.messages)
    json["messages"].push_back({{"error", message.error},
                                {"text", message.text},
                                {"button", message.button ? Json(message.button->label) : Json()}});
  json["log"] = Json::array();
  for (const LoggedMessage& message : model_.log) json["log"].push_back(message.text);
  json["renders"] = Json::array();
  for (const RenderEntry& entry : model_.renders)
    json["renders"].push_back(
        {{"file", entry.path}, {"state", static_cast<int>(entry.state)}, {"part", entry.part}, {"text", entry.text}});
  json["tool"] = static_cast<int>(model_.tool);
  json["local_axes"] = model_.axes == Axes::local;
  json["chosen"] = model_.chosen ? Json(title_of(model_.scene, *model_.chosen)) : Json();
  json["turntable"] = model_.navigation.turntable_degrees_per_second;
  json["fly"] = model_.navigation.fly != 0;
  json["scene"] = Json::parse(scene_text(model_.scene, path, SceneFormat::first));
  const Json current = Json::parse(scene_text(model_.scene, path));
  json["ocio"] = current["display"].value("ocio", Json());
  // Version 1 has no such sections.
  for (const char* key : {"volumes", "models", "lights"}) json[key] = current.value(key, Json::array());
  image::replace_file(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace cumulet::demo
