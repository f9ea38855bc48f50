{{- define "wade.name" -}}
{{- ternary .Release.Name (printf "%s-wade" .Release.Name) (contains "wade" .Release.Name) | trunc 63 | trimSuffix "-" }}
{{- end }}

{{- define "wade.selector" -}}
app.kubernetes.io/name: wade
app.kubernetes.io/instance: {{ .Release.Name }}
{{- end }}

{{- define "wade.labels" -}}
{{ include "wade.selector" . }}
app.kubernetes.io/version: {{ .Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .Release.Service }}
helm.sh/chart: {{ printf "%s-%s" .Chart.Name .Chart.Version }}
{{- end }}

{{- /* What no value may ask for at once, said before anything is rendered. */ -}}
{{- define "wade.check" -}}
{{- if and (not .Values.tls.secret) (not .Values.insecure) }}
{{- fail "tls.secret is empty: name a secret with tls.crt and tls.key, or set insecure=true to serve without encryption" }}
{{- end }}
{{- if and .Values.tls.secret .Values.insecure }}
{{- fail "insecure=true and tls.secret contradict each other: leave one out" }}
{{- end }}
{{- if and .Values.tls.clientCa (not .Values.tls.secret) }}
{{- fail "tls.clientCa needs tls.secret, whose ca.crt it reads" }}
{{- end }}
{{- if and .Values.access.tokensSecret (not .Values.tls.secret) }}
{{- fail "access.tokensSecret needs tls.secret: a token that travels in the clear is everybody's" }}
{{- end }}
{{- if and .Values.access.certificates (not .Values.tls.clientCa) }}
{{- fail "access.certificates needs tls.clientCa: without it no client shows a certificate" }}
{{- end }}
{{- $settings := fromToml .Values.settings }}
{{- if hasKey $settings "Error" }}
{{- fail (printf "settings is no TOML: %s" $settings.Error) }}
{{- end }}
{{- if or (hasKey $settings "tls") (hasKey $settings "access") }}
{{- fail "settings may not hold [tls] or [access]: the values tls and access write them" }}
{{- end }}
{{- $drain := $settings.drain_s | default 5.0 }}
{{- if le (float64 .Values.gracePeriodSeconds) (addf .Values.beforeStopSeconds $drain) }}
{{- fail (printf "gracePeriodSeconds is %v: more than beforeStopSeconds and drain_s, %v s together, is needed" .Values.gracePeriodSeconds (addf .Values.beforeStopSeconds $drain)) }}
{{- end }}
{{- if and (ne .Values.sharedMemory.wait "off") (not .Values.sidecars) }}
{{- fail "sharedMemory.wait is not off, but sidecars is empty: only containers of the same pod share its memory" }}
{{- end }}
{{- end }}
