# Turns a SPIR-V file into a C++ word array and moves specialisation ids to
# their real values (see glsl/constants.glsl): glslang itself refuses ids above
# 2046.
#
#   cmake -DINPUT=a.spv -DOUTPUT=a.inc -P embed_spirv.cmake
file(READ ${INPUT} hex HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${hex}")
# OpDecorate <id> SpecId <n>
string(REGEX REPLACE "(0x00040047u,0x[0-9a-f]+u,0x00000001u,)0x000000([0-7].)u," "\\10x525400\\2u," words "${words}")
foreach(digit RANGE 0 7)
  math(EXPR high "${digit} + 8")
  math(EXPR high "${high}" OUTPUT_FORMAT HEXADECIMAL)
  string(REPLACE "0x" "" high "${high}")
  string(REGEX REPLACE "(0x00040047u,0x[0-9a-f]+u,0x00000001u,)0x000000${high}(.)u,"
         "\\10x525401${digit}\\2u," words "${words}")
endforeach()
string(REGEX REPLACE "(0x........u,0x........u,0x........u,0x........u,0x........u,0x........u,0x........u,0x........u,)"
       "\\1\n" words "${words}")
file(WRITE ${OUTPUT} "${words}\n")
