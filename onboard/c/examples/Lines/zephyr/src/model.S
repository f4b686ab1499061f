    .section .note.GNU-stack, "", %progbits
    .section .rodata.model, "a"
    .balign 4
    .globl model_start, model_end
model_start:
    .incbin "model.palpate"
model_end:
