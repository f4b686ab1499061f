@ 6 trees for any Cortex-M (ARMv6-M). Written by `palpate export`; not to be edited.
@ The model's checksum is ed892af5, as in the names of functions: assembly of another export does not link.
@ void softmax_margins_ed892af5(const float row[4], int32_t margins[3])
	.syntax unified
	.thumb
	.section .note.GNU-stack,"",%progbits
	.section .text.softmax_margins_ed892af5,"ax",%progbits
	.balign 4
	.global softmax_margins_ed892af5
	.type softmax_margins_ed892af5, %function
	.thumb_func
softmax_margins_ed892af5:
	push {r1, r4-r7, lr}
	mov r4, r8
	mov r5, r9
	mov r6, r10
	mov r7, r11
	push {r4-r7}
	sub sp, #8
	mov r6, sp
	ldr.n r1, .Lsoftmax_7
	mov r3, r6
	adds r3, #1
	mov r12, r3
	movs r7, #255
	lsls r7, r7, #24
.Lsoftmax_11:
	ldrb r3, [r1]
	adds r1, #1
	lsls r3, r3, #2
	ldr r4, [r0, r3]
	lsls r5, r4, #1
	cmp r5, r7
	bhi.n .Lsoftmax_8
	movs r5, #0
	cmp r4, #0
	blt.n .Lsoftmax_12
	lsrs r3, r4, #23
	movs r5, #158
	subs r3, r5, r3
	movs r5, #255
	cmp r3, #24
	blt.n .Lsoftmax_13
	lsls r4, r4, #8
	movs r5, #128
	lsls r5, r5, #24
	orrs r5, r4
	lsrs r5, r3
.Lsoftmax_13:
.Lsoftmax_12:
.Lsoftmax_9:
	strb r5, [r6]
	adds r6, #1
	cmp r6, r12
	bne.n .Lsoftmax_11
	b.n .Lsoftmax_10
.Lsoftmax_8:
	movs r5, #255
	b.n .Lsoftmax_9
	.balign 4
.Lsoftmax_7:
	.word .Lsoftmax_0
.Lsoftmax_10:
	ldr.n r1, .Lsoftmax_14
	mov r3, r6
	adds r3, #1
	mov r12, r3
	ldr.n r2, .Lsoftmax_15
	movs r7, #255
	lsls r7, r7, #24
.Lsoftmax_19:
	ldrb r3, [r1]
	adds r1, #1
	lsls r3, r3, #2
	ldr r4, [r0, r3]
	lsls r3, r4, #1
	cmp r3, r7
	bhi.n .Lsoftmax_16
	mov r5, r2
	ldr r3, [r5, #4]
	cmp r3, r4
	bgt.n .Lsoftmax_20
	adds r5, #8
.Lsoftmax_20:
	ldr r3, [r5, #0]
	cmp r3, r4
	bgt.n .Lsoftmax_21
	adds r5, #4
.Lsoftmax_21:
	subs r5, r5, r2
	lsrs r5, r5, #2
.Lsoftmax_17:
	strb r5, [r6]
	adds r6, #1
	adds r2, #12
	cmp r6, r12
	bne.n .Lsoftmax_19
	b.n .Lsoftmax_18
.Lsoftmax_16:
	movs r5, #255
	b.n .Lsoftmax_17
	.balign 4
.Lsoftmax_14:
	.word .Lsoftmax_2
.Lsoftmax_15:
	.word .Lsoftmax_3
.Lsoftmax_18:
	ldr.n r1, .Lsoftmax_22
	mov r3, r6
	adds r3, #1
	mov r12, r3
	ldr.n r2, .Lsoftmax_23
	movs r7, #255
	lsls r7, r7, #24
.Lsoftmax_27:
	ldrb r3, [r1]
	adds r1, #1
	lsls r3, r3, #2
	ldr r4, [r0, r3]
	lsls r3, r4, #1
	cmp r3, r7
	bhi.n .Lsoftmax_24
	mov r5, r2
	ldr r3, [r5, #0]
	cmp r3, r4
	bgt.n .Lsoftmax_28
	adds r5, #4
.Lsoftmax_28:
	subs r5, r5, r2
	lsrs r5, r5, #2
.Lsoftmax_25:
	strb r5, [r6]
	adds r6, #1
	adds r2, #4
	cmp r6, r12
	bne.n .Lsoftmax_27
	b.n .Lsoftmax_26
.Lsoftmax_24:
	movs r5, #0
	b.n .Lsoftmax_25
	.balign 4
.Lsoftmax_22:
	.word .Lsoftmax_4
.Lsoftmax_23:
	.word .Lsoftmax_5
.Lsoftmax_26:
	b.n .Lsoftmax_6
	.balign 4
.Lsoftmax_3:
	.word 1147672181
	.word 1148097925
	.word 1148489354
	.balign 4
.Lsoftmax_5:
	.word 1076651581
.Lsoftmax_0:
	.byte 2
.Lsoftmax_2:
	.byte 1
.Lsoftmax_4:
	.byte 3
	.balign 4
.Lsoftmax_6:
	movs r1, #71
	movs r2, #193
	mov r0, sp
	ldrb r4, [r0, #0]
	ldrb r5, [r0, #1]
	cmp r5, #2
	bhi.n .Lsoftmax_30
	cmp r4, #0
	bhi.n .Lsoftmax_31
	b.n .Lsoftmax_29
.Lsoftmax_31:
	subs r1, #90
	adds r2, #34
	b.n .Lsoftmax_29
.Lsoftmax_30:
	cmp r4, #1
	bhi.n .Lsoftmax_32
	adds r1, #128
	adds r2, #180
	b.n .Lsoftmax_29
.Lsoftmax_32:
	subs r1, #52
	adds r2, #109
.Lsoftmax_29:
	cmp r5, #2
	bhi.n .Lsoftmax_34
	cmp r4, #0
	bhi.n .Lsoftmax_35
	b.n .Lsoftmax_33
.Lsoftmax_35:
	subs r1, #78
	adds r2, #117
	b.n .Lsoftmax_33
.Lsoftmax_34:
	cmp r4, #1
	bhi.n .Lsoftmax_36
	adds r1, #88
	adds r2, #116
	b.n .Lsoftmax_33
.Lsoftmax_36:
	subs r1, #42
	adds r2, #100
.Lsoftmax_33:
	lsls r1, r1, #8
	adds r1, r1, r2
	ldr r3, [sp, #24]
	stmia r3!, {r1}
	str r3, [sp, #24]
	movs r1, #64
	movs r2, #69
	mov r0, sp
	ldrb r4, [r0, #1]
	ldrb r5, [r0, #0]
	cmp r4, #0
	bhi.n .Lsoftmax_38
	cmp r5, #2
	bhi.n .Lsoftmax_39
	b.n .Lsoftmax_37
.Lsoftmax_39:
	subs r1, #83
	adds r2, #158
	b.n .Lsoftmax_37
.Lsoftmax_38:
	cmp r5, #1
	bhi.n .Lsoftmax_40
	adds r1, #9
	adds r2, #165
	b.n .Lsoftmax_37
.Lsoftmax_40:
	adds r1, #59
	adds r2, #246
.Lsoftmax_37:
	cmp r4, #0
	bhi.n .Lsoftmax_42
	cmp r5, #2
	bhi.n .Lsoftmax_43
	b.n .Lsoftmax_41
.Lsoftmax_43:
	subs r1, #79
	adds r2, #146
	b.n .Lsoftmax_41
.Lsoftmax_42:
	ldrb r3, [r0, #2]
	cmp r3, #0
	bhi.n .Lsoftmax_44
	adds r1, #13
	adds r2, #125
	b.n .Lsoftmax_41
.Lsoftmax_44:
	adds r1, #86
	adds r2, #206
.Lsoftmax_41:
	lsls r1, r1, #8
	adds r1, r1, r2
	ldr r3, [sp, #24]
	stmia r3!, {r1}
	str r3, [sp, #24]
	movs r1, #123
	movs r2, #65
	mov r0, sp
	ldrb r4, [r0, #0]
	ldrb r5, [r0, #1]
	cmp r5, #1
	bhi.n .Lsoftmax_46
	cmp r4, #0
	bhi.n .Lsoftmax_47
	b.n .Lsoftmax_45
.Lsoftmax_47:
	adds r1, #93
	adds r2, #180
	b.n .Lsoftmax_45
.Lsoftmax_46:
	cmp r4, #3
	bhi.n .Lsoftmax_48
	subs r1, #95
	adds r2, #101
	b.n .Lsoftmax_45
.Lsoftmax_48:
	adds r1, #80
	adds r2, #168
.Lsoftmax_45:
	cmp r5, #2
	bhi.n .Lsoftmax_50
	cmp r4, #0
	bhi.n .Lsoftmax_51
	b.n .Lsoftmax_49
.Lsoftmax_51:
	adds r1, #76
	adds r2, #30
	b.n .Lsoftmax_49
.Lsoftmax_50:
	cmp r4, #3
	bhi.n .Lsoftmax_52
	subs r1, #70
	adds r2, #24
	b.n .Lsoftmax_49
.Lsoftmax_52:
	adds r1, #98
	adds r2, #42
.Lsoftmax_49:
	lsls r1, r1, #8
	adds r1, r1, r2
	ldr r3, [sp, #24]
	stmia r3!, {r1}
	str r3, [sp, #24]
	add sp, #8
	pop {r4-r7}
	mov r8, r4
	mov r9, r5
	mov r10, r6
	mov r11, r7
	pop {r1, r4-r7, pc}
	.size softmax_margins_ed892af5, .-softmax_margins_ed892af5
