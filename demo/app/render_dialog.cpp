#include "render_dialog.hpp"

#include <imgui.h>

#include <algorithm>
#include <aov_table.hpp>
#include <array>
#include <filesystem>
#include <string>

namespace cumulet::demo {
namespace {

constexpr const char* popup = "Render###render";

struct Resolution {
  const char* name;
  std::uint32_t width;
  std::uint32_t height;
};
constexpr std::array resolutions = {
    Resolution{"HD 1280x720", 1280, 720},       Resolution{"Full HD 1920x1080", 1920, 1080},
    Resolution{"QHD 2560x1440", 2560, 1440},    Resolution{"4K 3840x2160", 3840, 2160},
    Resolution{"Square 1080x1080", 1080, 1080}, Resolution{"Portrait 1080x1920", 1080, 1920}};

}  // namespace

void RenderDialog::open(const Model& model) {
  opening_ = true;
  problem_.clear();
  const SceneOptions& scene = model.scene;
  settings_.samples = scene.sampling.samples;
  settings_.noise_percent = scene.sampling.noise_target_percent;
  if (settings_.file.denoise != Denoise::high)
    settings_.file.denoise = scene.display.denoise == CUMULET_DENOISE_OFF ? Denoise::off : Denoise::fast;
  settings_.sequence = settings_.sequence && model.status.play;
  if (const auto& play = model.status.play) {
    const cumulet_playback_desc played = playback_of(scene.sequence, play->row);
    settings_.range = {play->row.number(played.first_frame),
                       play->row.number(played.first_frame + std::max(played.frame_count, 1U) - 1)};
  }
  settings_.file.path = suggest_path(model, ending_of(settings_.file.format));
  folder_ = std::filesystem::path(settings_.file.path).parent_path();
  adapt_path();
}

void RenderDialog::adapt_path() {
  settings_.file.path = path_for(settings_.file.path, settings_.file.format, settings_.sequence);
}

void RenderDialog::resolution(Ui& ui) {
  std::vector<Choice> choices = {{"Custom", -1, "Width and height below."}};
  int chosen = -1;
  for (std::size_t i = 0; i < resolutions.size(); ++i) {
    choices.push_back({resolutions[i].name, static_cast<int>(i), "Sets width and height."});
    if (settings_.width == resolutions[i].width && settings_.height == resolutions[i].height)
      chosen = static_cast<int>(i);
  }
  if (ui.choose("Resolution", "Size of the picture. The view keeps its height.", choices, chosen) && chosen >= 0) {
    settings_.width = resolutions[static_cast<std::size_t>(chosen)].width;
    settings_.height = resolutions[static_cast<std::size_t>(chosen)].height;
  }
  ui.integer("Picture width", "In pixels.", settings_.width);
  ui.integer("Picture height", "In pixels.", settings_.height);
}

void RenderDialog::quality(Ui& ui) {
  ui.integer("Max samples", "Samples per pixel at most.", settings_.samples);
  ui.slider("Noise target", "Ends when the noise of the samples is this small.", settings_.noise_percent, 0.0f, 20.0f,
            settings_.noise_percent > 0.0f ? "%.1f %%" : "none");
  ui.slider("Time limit", "Ends after this time per picture.", settings_.time_limit, 0.0f, 3600.0f,
            settings_.time_limit > 0.0f ? "%.0f s" : "none", ImGuiSliderFlags_Logarithmic);
  int denoise = static_cast<int>(settings_.file.denoise);
  const std::vector<Choice> choices = {
      {"Off", static_cast<int>(Denoise::off), "The samples as they are."},
      {"Fast", static_cast<int>(Denoise::fast), "A wavelet filter, as in the window."},
      {"High", static_cast<int>(Denoise::high),
       "A network of Open Image Denoise, if scripts/install_oidn_weights.sh has installed it."}};
  if (ui.choose("Denoise", "Filter of the finished picture. For EXR an additional layer.", choices, denoise))
    settings_.file.denoise = static_cast<Denoise>(denoise);
}

void RenderDialog::format(Ui& ui) {
  int format = static_cast<int>(settings_.file.format);
  const std::vector<Choice> choices = {
      {"PNG", static_cast<int>(PictureFormat::png), "As displayed, 8 bits per channel."},
      {"EXR", static_cast<int>(PictureFormat::exr), "Linear radiance and layers, 32 bits per channel."},
      {"WebP", static_cast<int>(PictureFormat::webp), "As displayed, lossless, smaller than PNG."}};
  if (ui.choose("Format", "File format.", choices, format)) {
    settings_.file.format = static_cast<PictureFormat>(format);
    adapt_path();
  }
}

void RenderDialog::layers(Ui& ui) {
  ImGui::BeginChild("layers", {0.0f, ui.px(120.0f)}, true, ImGuiWindowFlags_NavFlattened);
  std::vector<cumulet_aov>& aovs = settings_.file.aovs;
  const auto row = [&ui](const std::string& name, const char* tip, bool& on) {
    const bool changed = ImGui::Checkbox((name + "##layer").c_str(), &on);
    ui.remember(("Layer/" + name).c_str(), tip);
    return changed;
  };
  for (const settings::Aov& aov : settings::named_aovs) {
    const auto found = std::ranges::find(aovs, aov.value);
    bool on = found != aovs.end();
    if (!row(std::string(aov.name), "A layer of the EXR file; see docs/aovs.md.", on)) continue;
    if (on)
      aovs.push_back(aov.value);
    else
      aovs.erase(found);
  }
  row("cryptomatte", "Mattes of all objects.", settings_.file.cryptomatte);
  ImGui::EndChild();
}

void RenderDialog::frames(Ui& ui, const Model& model) {
  const FrameRow& row = model.status.play->row;
  if (ui.checkbox("Sequence", "Renders a range of frames, one file each.", settings_.sequence)) adapt_path();
  if (!settings_.sequence) return;
  const Frame least = row.number(0);
  const Frame most = row.number(row.count() - 1);
  ui.slider("First frame", "First rendered frame.", settings_.range.first, least, most, "%d");
  ui.slider("Last frame", "Last rendered frame.", settings_.range.last, least, most, "%d");
}

void RenderDialog::draw(Ui& ui, const Model& model, std::vector<Command>& commands) {
  if (opening_) ImGui::OpenPopup(popup);
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x * 0.5f, screen.y * 0.5f}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSize({std::min(ui.px(480.0f), screen.x * 0.95f), 0.0f});
  ImGui::SetNextWindowSizeConstraints({0.0f, 0.0f}, {screen.x, screen.y * 0.98f});
  open_ = ImGui::BeginPopupModal(
      popup, nullptr, ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_AlwaysAutoResize);
  opening_ = false;
  if (!open_) return;
  bool starts = ui.text("Picture file", "Path of the file. Press Enter to render.", "File name", settings_.file.path);
  resolution(ui);
  quality(ui);
  format(ui);
  if (settings_.file.format == PictureFormat::exr) layers(ui);
  if (model.status.play) frames(ui, model);
  if (!problem_.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, {0.95f, 0.55f, 0.45f, 1.0f});
    ImGui::TextWrapped("%s", problem_.c_str());
    ImGui::PopStyleColor();
  }
  ImGui::Spacing();
  const ImVec2 size(ui.px(110.0f), 0.0f);
  starts |= ui.button("Start render", "Renders in the background; the window stays usable.", size);
  ImGui::SameLine();
  const bool escape = ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)) && !ImGui::IsAnyItemActive();
  if (ui.button("Close render", "Closes the dialog (Escape).", size) || escape) close();
  if (starts) {
    // A name that was typed belongs to the folder of the suggested file.
    settings_.file.path = (folder_ / settings_.file.path).lexically_normal().string();
    adapt_path();
    problem_ = problem_of(settings_);
    if (problem_.empty()) {
      commands.push_back({Action::render});
      close();
    }
  }
  ImGui::EndPopup();
}

void RenderDialog::close() {
  open_ = false;
  ImGui::CloseCurrentPopup();
}

}  // namespace cumulet::demo
