// Writes the seeds of nanovdb_fuzz into a folder.

#define NANOVDB_USE_BLOSC
#define NANOVDB_USE_ZIP
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>

#include "fuzz/seed_folder.hpp"
#include "fuzz/seed_grid.hpp"

int main(int argc, char** argv) {
  const cumulet::test::SeedFolder folder(argc, argv);
  const auto write = [&](const std::string& name, const auto& handle, nanovdb::io::Codec codec) {
    nanovdb::io::writeGrid((folder.path() / name).string(), handle, codec);
  };
  auto grid = cumulet::test::seed_grid();
  write("plain.nvdb", nanovdb::openToNanoVDB(*grid), nanovdb::io::Codec::NONE);
  write("zip.nvdb", nanovdb::openToNanoVDB(*grid), nanovdb::io::Codec::ZIP);
  write("blosc.nvdb", nanovdb::openToNanoVDB(*grid), nanovdb::io::Codec::BLOSC);
  write("fpn.nvdb", nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, nanovdb::FpN>(*grid),
        nanovdb::io::Codec::ZIP);
  write("fp8.nvdb", nanovdb::openToNanoVDB<nanovdb::HostBuffer, openvdb::FloatTree, nanovdb::Fp8>(*grid),
        nanovdb::io::Codec::ZIP);
  // Buffers without a file header: of two grids, and as OpenVDB 13 writes them.
  const auto handle = nanovdb::openToNanoVDB(*grid);
  const std::string buffer(reinterpret_cast<const char*>(handle.data()), handle.size());
  folder.write("buffers.nvdb", buffer + buffer);
  std::string later = buffer;
  auto& data = *reinterpret_cast<nanovdb::GridData*>(later.data());
  later[7] = '1';
  data.mVersion = nanovdb::Version(32, 9, 0);
  folder.write("later_buffer.nvdb", later);
  return 0;
}
