# Flags of compilers and linkers. GCC, Clang and MSVC understand different ones.

# OpenVDB's headers keep default visibility. With hidden visibility their templates would exist twice, while the helper
# inside std::call_once, which has default visibility, exists once. libopenvdb's initialize() would then fill our copy
# of a string, read its own copy and crash. (src/cumulet.map decides which symbols libcumulet exports, not this.)
if(CUMULET_OPENVDB AND NOT MSVC)
  target_compile_options(OpenVDB::openvdb INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-fvisibility=default>
                         $<$<COMPILE_LANG_AND_ID:CXX,GNU,Clang>:-fno-semantic-interposition>)
endif()

# Compile flags of our own targets. Targets that link the library do not inherit them.
add_library(cumulet_flags INTERFACE)
if(MSVC)
  target_compile_options(cumulet_flags INTERFACE /W4 /utf-8 /bigobj /permissive- /Zc:__cplusplus
                         $<$<BOOL:${CUMULET_WERROR}>:/WX>)
  target_compile_definitions(cumulet_flags INTERFACE NOMINMAX _CRT_SECURE_NO_WARNINGS)
else()
  target_compile_options(cumulet_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                         $<$<BOOL:${CUMULET_WERROR}>:-Werror>)
  # GCC's checks of ranges report impossible copies of short strings (bugs 105329 and 105651), depending on inlining and
  # even on the length of the source folder's path. They stay warnings, so that no clone fails to build for its place.
  foreach(check IN ITEMS array-bounds restrict stringop-overflow stringop-overread)
    target_compile_options(cumulet_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-error=${check}>)
  endforeach()
endif()
if(CUMULET_SANITIZE)
  target_compile_options(cumulet_flags INTERFACE -fsanitize=${CUMULET_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=undefined)
  target_link_options(cumulet_flags INTERFACE -fsanitize=${CUMULET_SANITIZE})
endif()

# A shared library exports only the symbols that a version script lists. Only ELF has version scripts.
function(cumulet_export_only target map)
  if(UNIX AND NOT APPLE)
    target_link_options(${target} PRIVATE -Wl,--version-script=${map})
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${map})
  endif()
endfunction()
