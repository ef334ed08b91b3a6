// Writes the seeds of scene_fuzz into a folder.

#include "fuzz/seed_folder.hpp"
#include "scene_file.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  cumulet::demo::SceneOptions scene;
  folder.write("empty.json", R"({"cumulet_scene": 1})");
  folder.write("plain.json", cumulet::demo::scene_text(scene, "/nowhere/plain.json"));
  scene.set_daylight();
  scene.volume = "/nowhere/clouds/cloud.vdb";
  scene.grid_name = "density[1]";
  scene.up = cumulet::demo::UpAxis::z;
  scene.surfaces = "/elsewhere/tower.glb";
  scene.surface_camera = 1;
  scene.auto_density_scale = false;
  scene.medium.density_scale = 4.0;
  scene.camera.eye[2] = 90.0;
  scene.camera.up[1] = 1.0;
  folder.write("first.json", cumulet::demo::scene_text(scene, "/nowhere/full.json", cumulet::demo::SceneFormat::first));
  scene.analytic_lights.emplace_back().kind = CUMULET_LIGHT_SPOT;
  scene.cameras.emplace_back().name = "front";
  scene.cameras.back().camera = scene.camera;
  folder.write("second.json",
               cumulet::demo::scene_text(scene, "/nowhere/full.json", cumulet::demo::SceneFormat::second));
  folder.write("full.json", cumulet::demo::scene_text(scene, "/nowhere/full.json"));
  return 0;
}
